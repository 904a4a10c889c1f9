/** Sign-in by the token of the address, and the page's access status. */

/**
 * Submits the token of the address, if there is one, and removes it from the address. The token is in the fragment,
 * which browsers do not send, and becomes a cookie that scripts cannot read.
 */
export async function signIn(): Promise<void> {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  if (token === null) return;
  history.replaceState(null, "", location.pathname + location.search);
  try {
    await fetch("/enter", { method: "POST", body: token, headers: { "content-type": "text/plain" } });
  } catch {
    // The socket will not open either, and the page reports that.
  }
}

/** Access of the page: granted, refused for a reason, or no response. */
export type AccessStatus = "in" | "token" | "name" | "full" | "silent";

const STATUS_BY_CODE: Record<number, AccessStatus> = { 204: "in", 401: "token", 403: "name", 421: "name", 503: "full" };

export function accessStatusOf(status: number): AccessStatus {
  return STATUS_BY_CODE[status] ?? "silent";
}

/** After this time a request counts as unanswered. */
const REQUEST_TIMEOUT_MS = 5000;

/** Fetches the access status: a refused socket does not tell the reason. */
export async function fetchAccessStatus(): Promise<AccessStatus> {
  try {
    const { status } = await fetch("/enter", { cache: "no-store", signal: AbortSignal.timeout(REQUEST_TIMEOUT_MS) });
    return accessStatusOf(status);
  } catch {
    return "silent";
  }
}

/** The cause and the remedy for each status. */
export const ACCESS_TEXTS: Record<AccessStatus, string> = {
  in: "The connection was lost, but the server answers.",
  token:
    "The server does not recognize this page: it was restarted, or the browser has lost its token. Open the whole address that the server has printed.",
  name: "The server does not accept this address: open the one that it has printed.",
  full: "Too many pages are open on this server. Close another one; this page will retry.",
  silent: "The server does not answer. It may have been stopped: start `sidestep studio` again.",
};
