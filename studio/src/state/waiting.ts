/** Promises that wait for a condition: checked at every change, and let go when it can no longer come true. */

export class Waiting {
  /** Each returns whether its wait is over. */
  readonly #open = new Set<(isOver: boolean) => boolean>();

  /** Checks all waits after a change. */
  changed(): void {
    this.#tell(false);
  }

  /** Ends all waits: nothing more will come. */
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
