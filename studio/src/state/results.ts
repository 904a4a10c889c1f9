/** Addresses at which the server makes results of recordings and sweeps: reports, and what can be exported. */

function address(route: string, fields: Record<string, string | number | undefined>): string {
  const given = Object.entries(fields).filter(([, value]) => value !== undefined);
  return `/${route}?${given.map(([name, value]) => `${name}=${encodeURIComponent(String(value))}`).join("&")}`;
}

/** The report of a folder, or a part of it: `html`, `markdown`, `figures`, or the name of a figure. */
export function reportAddress(path: string, part?: string): string {
  return address("report", { path, as: part });
}

export interface Export {
  /** A format of `sidestep export`. */
  form: string;
  table?: string;
  cycle?: number;
}

export function exportAddress(path: string, { form, table, cycle }: Export): string {
  return address("export", { path, as: form, table, cycle });
}

/** Keeps what was made here as a file. */
export function keepFile(blob: Blob, name: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** A name of a file that needs no quoting anywhere. */
export function plainName(name: string): string {
  return name.replace(/[^\w.-]+/g, "-").replace(/^[-.]+|-+$/g, "") || "sidestep";
}
