/** Functions that tests run in the page, and one for Node.js. */

/** Records each image that the page shows. Requests for drafts are not sent before a call of record.held, if that is a list. */
function recordImages() {
  if (window.record) { record.shown = []; return; }
  window.record = {shown: [], inFlight: 0, most: 0, held: null, last: document.querySelector('.canvas img').src};
  new MutationObserver(() => {
    const image = document.querySelector('.canvas img');
    if (image && image.src !== record.last) record.shown.push([record.last = image.src, image.dataset.kind]);
  }).observe(document.querySelector('.stage'), {subtree: true, childList: true, attributes: true});
  const fetched = window.fetch;
  window.fetch = async (...request) => {
    if (request[0] !== '/v1/render') return fetched(...request);
    record.most = Math.max(record.most, ++record.inFlight);
    if (record.held) await new Promise((send) => record.held.push(send));
    try { return await fetched(...request); } finally { --record.inFlight; }
  };
}

/** Drops a file of base64 bytes at the cursor of an editor. */
function dropFile(view, name, bytes) {
  const data = new DataTransfer(), box = view.coordsAtPos(Math.min(view.state.doc.length, view.state.selection.main.head));
  data.items.add(new File([Uint8Array.from(atob(bytes), (letter) => letter.charCodeAt(0))], name, {type: name.endsWith('png') ? 'image/png' : ''}));
  view.contentDOM.dispatchEvent(new DragEvent('drop', {dataTransfer: data, bubbles: true, cancelable: true, clientX: box.left, clientY: box.top + 4}));
}

/** The element with the focus, or null. */
function focused() {
  let at = document.activeElement;
  while (at?.shadowRoot?.activeElement) at = at.shadowRoot.activeElement;
  if (!at || at === document.body) return null;
  const box = at.getBoundingClientRect();
  let ring = at, rings = 0;  // an editor draws the ring around itself
  for (; ring && rings < 4; ring = ring.parentElement, ++rings) {
    const style = getComputedStyle(ring);
    if (style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) > 0) break;
  }
  const inView = box.width > 0 && box.height > 0 && box.right > 0 && box.bottom > 0 && box.left < innerWidth && box.top < innerHeight;
  return {tag: at.tagName, name: (at.getAttribute('aria-label') || at.textContent).trim(), visible: inView && !!ring && rings < 4, editing: at.isContentEditable};
}

/** The codes of the image that an element shows; null before it is decoded. */
function codesOf(selector) {
  const image = document.querySelector(selector);
  return image.decode().then(() => {
    const {naturalWidth: width, naturalHeight: height} = image, context = new OffscreenCanvas(width, height).getContext('2d');
    context.drawImage(image, 0, 0);
    return [...context.getImageData(0, 0, width, height).data].filter((_, i) => i % 4 < 3);
  }, () => null);
}

/** Points at a pixel of an image of 80 x 60 pixels; the caption after that. */
function captionAt(x, y) {
  const box = document.querySelector('.canvas'), image = box.querySelector('img').getBoundingClientRect();
  box.dispatchEvent(new PointerEvent('pointermove', {clientX: image.left + (x + 0.5) * image.width / 80, clientY: image.top + (y + 0.5) * image.height / 60, bubbles: true}));
  return document.querySelector('.viewer .caption').innerText;
}

/** Time, state and code of the rows of a job's history. */
function moves() {
  return [...document.querySelectorAll('.moves tbody tr')].map((row) => [row.querySelector('time').dateTime, row.querySelector('.state').textContent.trim(), row.querySelector('code')?.textContent ?? ''])
    .map(([at, state, code]) => [at, state, state === 'running' ? '' : code]);
}

/** The sentences that are announced from now on. */
function recordAnnounced() {
  const live = document.querySelector('[aria-live]');
  window.announced = [];
  new MutationObserver(() => announced.push(live.textContent)).observe(live, {childList: true, characterData: true, subtree: true});
}

/** The places of an animation that are shown from now on. */
function recordFrames() {
  const canvas = document.querySelector('.player canvas');
  window.seen = [];
  new MutationObserver(() => seen.push(Number(canvas.dataset.shown))).observe(canvas, {attributeFilter: ['data-shown']});
}

/** Validation of a text with "slow" in it estimates 9 s. */
function slowValidation() {
  const fetched = window.fetch;
  window.fetch = async (...request) => {
    const reply = await fetched(...request);
    return request[0] === '/v1/jobs/validate' && request[1].body.includes('slow') ? Response.json({...await reply.json(), estimate: {seconds: 9}}) : reply;
  };
}

/** In Node.js, beside the sources of the page: prints for each file of a directory its channels or the sentence of its refusal. */
async function printChannels(directory) {
  const {readExr} = await import(`${process.cwd()}/exr.js`), {readdirSync, readFileSync} = await import('node:fs');
  const found = {}, text = ({buffer}) => Buffer.from(buffer).toString('base64');
  for (const name of readdirSync(directory)) {
    const bytes = Uint8Array.from(readFileSync(`${directory}/${name}`)).buffer;
    found[name] = await readExr(bytes).then(({channels}) => Object.fromEntries(Object.entries(channels).map(([name, values]) => [name, text(values)])), ({message}) => message);
  }
  console.log(JSON.stringify(found));
}

/** Barriers that axe finds. */
async function violations(rules) {
  const {violations} = await axe.run(document, {runOnly: rules});
  return violations.map(({id, nodes}) => `${id}: ${nodes.map((node) => `${node.target.join(' ')} ${node.failureSummary}`).join('; ')}`);
}

/** The CodeMirror view of the editor. */
function editorView() {
  const content = document.querySelector('.editor').shadowRoot.querySelector('.cm-content');
  return content.cmTile?.view ?? content.cmView.view;
}

/** The lines of the editor in view; empty before there is one. */
function editorText() {
  return document.querySelector('.editor')?.shadowRoot?.querySelector('.cm-content')?.textContent ?? '';
}

/** Scrolls the sheet of a batch to its last cell. */
function scrollToLastCell() {
  const box = document.querySelector('.axes'), main = document.querySelector('main');
  if (box) box.scrollLeft = box.scrollWidth;
  main.scrollTop = main.scrollHeight;
}

/** Pixels by which parts of the page are too wide. */
function sidewaysScroll() {
  return Math.max(...[document.documentElement, ...document.querySelectorAll('main, main .page')].map((each) => each.scrollWidth - each.clientWidth));
}

/** Sizes of the page's own files that came over the network. */
function transferSizes() {
  return performance.getEntriesByType('resource').filter(({name}) => name.includes('/ui/') && !name.endsWith('-worker.js')).map(({transferSize}) => transferSize);
}

/** Types a value into a field that is found by a selector. */
function type(selector, value) {
  const field = document.querySelector(selector);
  field.value = value;
  field.dispatchEvent(new Event('input', {bubbles: true}));
}
