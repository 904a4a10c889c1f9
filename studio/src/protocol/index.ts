/** Everything that the page knows of the protocol: the server's types, and names for types without one there. */
export * from "./types";

/** x, y and z in meters. */
export type Point3 = [number, number, number];
