/** Promises that wait for a condition: checked at every change, and resolved with null when it can no longer hold. */

export class Waiters {
  /** Each returns whether its wait has ended. */
  readonly #waiting = new Set<(isOver: boolean) => boolean>();

  /** Checks all conditions after a change. */
  check(): void {
    this.#settle(false);
  }

  /** Ends all waits. */
  cancelAll(): void {
    this.#settle(true);
  }

  /** Waits until `find` returns a value; `null` if the wait is ended first. */
  waitFor<T>(find: () => T | null): Promise<T | null> {
    return new Promise((resolve) => {
      const isDone = (isOver: boolean): boolean => {
        const found = isOver ? null : find();
        if (found === null && !isOver) return false;
        resolve(found);
        return true;
      };
      if (!isDone(false)) this.#waiting.add(isDone);
    });
  }

  #settle(isOver: boolean): void {
    for (const isDone of this.#waiting) if (isDone(isOver)) this.#waiting.delete(isDone);
  }
}
