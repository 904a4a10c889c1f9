/** The parts of a replay in one file: deflated bytes as base64, one in a line of an element of the document. */

/** Reads parts by their numbers; 0 is the directory. */
export interface Parts {
  bytes(part: number): Promise<Uint8Array<ArrayBuffer>>;
  json<T>(part: number): Promise<T>;
}

/** The element of a document with the parts; a page that a server has sent has none. */
const ELEMENT_ID = "replay";

/** The parts that a document holds; null for a page of a server. */
export function embeddedParts(document: Document): Parts | null {
  const text = document.getElementById(ELEMENT_ID)?.textContent;
  return text ? partsOf(text) : null;
}

/** The parts of a text. */
export function partsOf(text: string): Parts {
  const lines = text.trim().split("\n");
  const bytes = async (part: number): Promise<Uint8Array<ArrayBuffer>> => {
    const line = lines[part];
    if (line === undefined) throw new Error(`the replay has no part ${part}: the file is not whole`);
    return inflate(fromBase64(line));
  };
  const json = async <T>(part: number): Promise<T> => JSON.parse(new TextDecoder().decode(await bytes(part))) as T;
  return { bytes, json };
}

function fromBase64(text: string): Uint8Array<ArrayBuffer> {
  const packed = atob(text);
  const bytes = new Uint8Array(packed.length);
  for (let i = 0; i < packed.length; i++) bytes[i] = packed.charCodeAt(i);
  return bytes;
}

async function inflate(bytes: Uint8Array<ArrayBuffer>): Promise<Uint8Array<ArrayBuffer>> {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
