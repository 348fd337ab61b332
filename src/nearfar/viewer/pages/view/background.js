// Work that the server does in the background: one request under way, and the newest after it, never a backlog.

const MOMENT_MILLISECONDS = 300;

export class BackgroundJob {
  #onStatus;
  #next = null;
  #controller = null;
  #isRunning = false;

  // onStatus(text) is told what goes on or went wrong, '' once all is done.
  constructor(onStatus) { this.#onStatus = onStatus; }

  // Steps are functions of a signal, done in turn. The first of them is finished even if something newer is asked for, so
  // that pictures come while a slider moves; the others are given up.
  ask(steps) {
    this.#next = steps;
    if (this.#controller && !this.#controller.isFirst) this.#controller.abort();
    if (!this.#isRunning) this.#run();
  }

  cancel() {
    this.#next = null;
    this.#controller?.abort();
  }

  async #run() {
    this.#isRunning = true;
    const timer = setTimeout(() => this.#onStatus('computing'), MOMENT_MILLISECONDS);
    let fault = '';
    while (this.#next) {
      const steps = this.#next;
      this.#next = null;
      fault = await this.#runAll(steps);
    }
    clearTimeout(timer);
    this.#isRunning = false;
    this.#onStatus(fault);
  }

  // Does steps until one fails or something newer is asked for; returns what went wrong.
  async #runAll(steps) {
    for (const [i, step] of steps.entries()) {
      if (this.#next) return '';
      const controller = this.#controller = Object.assign(new AbortController(), { isFirst: i === 0 });
      try { await step(controller.signal); } catch (error) { return controller.signal.aborted ? '' : error.message; } finally { this.#controller = null; }
      if (controller.signal.aborted) return '';
    }
    return '';
  }
}
