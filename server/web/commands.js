/** Programs that render a document without a browser: for a shell with curl, for Python, and for the command line of Whittle. */
import {key} from './api.js';

/** @param {string} document */
function curl(document) {
  const keyed = key.value ? ' -H "Authorization: Bearer $WHITTLE_KEY"' : '';
  return `curl -s --fail --json @-${keyed} -H 'Accept: image/png' -o image.png ${location.origin}/v1/render <<'END'\n${document.trim()}\nEND\n`;
}

/** @param {string} document */
function python(document) {
  const text = document.trim(), literal = text.includes("'''") ? JSON.stringify(text) : `r'''${text}'''`;
  const keyed = key.value ? ', "Authorization": "Bearer " + os.environ["WHITTLE_KEY"]' : '';
  return `${key.value ? 'import os\n' : ''}import urllib.request

scene = ${literal}
headers = {"Content-Type": "application/json", "Accept": "image/png"${keyed}}
request = urllib.request.Request("${location.origin}/v1/render", scene.encode(), headers)
with urllib.request.urlopen(request) as reply, open("image.png", "wb") as file:
    file.write(reply.read())
`;
}

/** @param {string} document */
const whittle = (document) => `whittle render - -o image.png <<'END'\n${document.trim()}\nEND\n`;

/** By name, in the order of menus. @type {Record<'curl' | 'python' | 'whittle', (document: string) => string>} */
export const commands = {curl, python, whittle};
