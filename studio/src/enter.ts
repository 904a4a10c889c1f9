/** The way in: the token of the address, and how one stands with the server. */

/**
 * Hands in the token of the address, if there is one, and takes it out of the address. It comes in the fragment, which
 * browsers keep to themselves, and becomes a cookie that scripts cannot read.
 */
export async function enter(): Promise<void> {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  if (token === null) return;
  history.replaceState(null, "", location.pathname + location.search);
  try {
    await fetch("/enter", { method: "POST", body: token, headers: { "content-type": "text/plain" } });
  } catch {
    // The socket will not open either, and the page says so then.
  }
}

/** The page's standing with the server: let in, refused for a reason, or without an answer. */
export type Standing = "in" | "token" | "name" | "full" | "silent";

const STANDINGS: Record<number, Standing> = { 204: "in", 401: "token", 403: "name", 421: "name", 503: "full" };

export function standingOf(status: number): Standing {
  return STANDINGS[status] ?? "silent";
}

/** An answer that takes longer is none. */
const LONGEST_MS = 5000;

/** Asks the server how the page stands: a socket that is refused does not say why. */
export async function standing(): Promise<Standing> {
  try {
    const { status } = await fetch("/enter", { cache: "no-store", signal: AbortSignal.timeout(LONGEST_MS) });
    return standingOf(status);
  } catch {
    return "silent";
  }
}

/** Words for each standing: the cause, and the remedy. */
export const STANDING_WORDS: Record<Standing, string> = {
  in: "The connection was lost, but the server answers.",
  token:
    "The server does not know this page any more: it was started anew, or the browser has forgotten its token. Open the whole address that it has printed.",
  name: "The server does not take this address: open the one that it has printed.",
  full: "The server is full: so many pages are open. Close one of the others; this one tries again.",
  silent: "The server does not answer. It may have been ended: start `sidestep studio` again.",
};
