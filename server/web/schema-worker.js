/** Language service of scene documents, apart from the page: validating 400 kB takes 400 ms. */
import {getLanguageService, TextDocument} from 'vscode-json-languageservice';

const service = getLanguageService({});
let version = 0;

/** @param {string} text */
function open(text) {
  const document = TextDocument.create('whittle:/scene.json', 'json', ++version, text);
  return {document, json: service.parseJSONDocument(document)};
}

/** @param {TextDocument} document @param {import('vscode-json-languageservice').Range} range */
const offsets = (document, range) => ({from: document.offsetAt(range.start), to: document.offsetAt(range.end)});

/** @param {string | import('vscode-json-languageservice').MarkupContent | undefined} text */
const plain = (text) => typeof text === 'string' ? text : text?.value || '';

/** @type {Record<string, (text: string, offset: number) => Promise<any>>} */
const methods = {
  async complete(text, offset) {
    const {document, json} = open(text);
    const list = await service.doComplete(document, document.positionAt(offset), json);
    return (list?.items || []).map((item) => {
      const edit = /** @type {import('vscode-json-languageservice').TextEdit | undefined} */ (item.textEdit);
      return {label: item.label, kind: item.kind, info: plain(item.documentation), text: edit?.newText || item.insertText || item.label,
              ...(edit ? offsets(document, edit.range) : {from: offset, to: offset})};
    });
  },
  async lint(text) {
    const {document, json} = open(text);
    const found = await service.doValidation(document, json);
    return found.map((each) => ({...offsets(document, each.range), message: each.message, severity: each.severity}));
  },
  async hover(text, offset) {
    const {document, json} = open(text);
    const found = await service.doHover(document, document.positionAt(offset), json);
    const [first] = Array.isArray(found?.contents) ? found.contents : [found?.contents];
    return first && plain(/** @type {any} */ (first));
  },
};

onmessage = async ({data}) => {
  if (data.schema) {
    service.configure({validate: true, schemas: [{uri: 'whittle:/schema', fileMatch: ['*'], schema: data.schema}]});
    return;
  }
  try {
    postMessage({id: data.id, result: await methods[data.method](data.text, data.offset)});
  } catch (error) {
    postMessage({id: data.id, error: String(error)});
  }
};
