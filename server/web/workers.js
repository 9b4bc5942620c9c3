/** Starts the workers of the page. The policy of the page wants script addresses that a trusted policy made. */

/** @type {{createScriptURL: (url: string) => any} | undefined} */
const policy = /** @type {any} */ (globalThis).trustedTypes?.createPolicy('whittle-workers', {
  createScriptURL: (/** @type {string} */ url) => {
    if (new URL(url).origin !== location.origin) throw new TypeError(`${url} is of another origin`);
    return url;
  },
});

/** Address of a worker's module beside this one. @param {string} name @returns {string} */
export function workerUrl(name) {
  const url = new URL(`./${name}`, import.meta.url).href;
  return policy ? policy.createScriptURL(url) : url;
}

/** A worker that answers each message {id, ...} with {id, result} or {id, error}. */
export class Caller {
  /** @param {string} name module of the worker */
  constructor(name) {
    this.worker = new Worker(workerUrl(name), {type: 'module'});
    /** @type {Map<number, {resolve: (value: any) => void, reject: (reason: any) => void}>} */
    this.waiting = new Map();
    this.last = 0;
    this.worker.onmessage = ({data}) => {
      const waiting = this.waiting.get(data.id);
      this.waiting.delete(data.id);
      if (data.error !== undefined) waiting?.reject(new Error(data.error));
      else waiting?.resolve(data.result);
    };
  }

  /** @param {Record<string, any>} message @param {Transferable[]} [transfer] @returns {Promise<any>} */
  call(message, transfer = []) {
    const id = ++this.last;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, {resolve, reject});
      this.worker.postMessage({...message, id}, transfer);
    });
  }

  stop() { this.worker.terminate(); }
}
