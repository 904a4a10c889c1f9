/** Promises that wait for something to be so: told whenever it may be, and let go when it cannot come any more. */

export class Waiting {
  /** Each says whether it has what it waits for. */
  readonly #open = new Set<(isOver: boolean) => boolean>();

  /** Something has changed. */
  changed(): void {
    this.#tell(false);
  }

  /** Nothing will come any more. */
  over(): void {
    this.#tell(true);
  }

  /** Waits until something is found; `null` when it is over before. */
  for<T>(find: () => T | null): Promise<T | null> {
    return new Promise((resolve) => {
      const isDone = (isOver: boolean): boolean => {
        const found = isOver ? null : find();
        if (found === null && !isOver) return false;
        resolve(found);
        return true;
      };
      if (!isDone(false)) this.#open.add(isDone);
    });
  }

  #tell(isOver: boolean): void {
    for (const isDone of this.#open) if (isDone(isOver)) this.#open.delete(isDone);
  }
}
