/** The token: comes in the fragment, which browsers keep to themselves, and becomes a cookie that scripts cannot read. */

/** Hands in the token of the address, if there is one, and takes it out of the address. */
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
