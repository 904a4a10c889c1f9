/** Everything that the page knows of the protocol: the server's types, and a name for what has none there. */
export * from "./types";

/** x, y and z in meters. */
export type Place = [number, number, number];
