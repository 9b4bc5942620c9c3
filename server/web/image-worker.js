/** Work on bytes apart from the page: SHA-256, also where the page is no secure context. */
import {sha256} from './sha256.js';

/** @type {Record<string, (message: any) => Promise<any>>} */
const methods = {
  sha256: async ({bytes}) => sha256(bytes),
};

onmessage = async ({data}) => {
  try {
    postMessage({id: data.id, result: await methods[data.method](data)});
  } catch (error) {
    postMessage({id: data.id, error: error instanceof Error ? error.message : String(error)});
  }
};
