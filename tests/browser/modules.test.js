/** Modules of the page that need no browser. The working directory has their sources, $WHITTLE_PAGE those of the bundle; modules_test.py runs this file. */
const assert = require('node:assert/strict');
const {readFileSync} = require('node:fs');
const {test} = require('node:test');

const storage = {getItem: () => null, setItem: () => undefined};
Object.assign(globalThis, {sessionStorage: storage, localStorage: storage, location: {hash: ''}, addEventListener: () => undefined, onmessage: null, window: globalThis});
const load = (name) => import(`${process.cwd()}/${name}`);

test('values of a sweep are ranges or JSON with commas', async () => {
  const {indexOf, valuesOf} = await load('sweep.js');
  const cases = [
    ['30..60:5', [30, 35, 40, 45, 50, 55, 60]], ['1..0:0.25', [1, 0.75, 0.5, 0.25, 0]], ['0..1:0.1', [0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1]],
    ['1..3', [1, 2, 3]], ['1, 2', [1, 2]], ['[0, 1], [2, 3]', [[0, 1], [2, 3]]], ['"a"', ['a']], ['', null], ['a', null], ['1..2:0', null], ['0..1:1e-9', null],
  ];
  for (const [written, expected] of cases) assert.deepEqual(valuesOf(written), expected, written);
  assert.equal(indexOf({a: [1, 2], b: [1, 2, 3], c: [1, 2, 3, 4]}, [1, 2, 3]), 23);
});

test('the service has a word for every state', async () => {
  const {serviceState} = await load('service-state.js');
  const waiting = {jobs: {running: 0, queued: 3}};
  const health = {ready: true, reason: '', draining: false, disk: {free_bytes: 5e6, reserve_bytes: 6e7}, limits: {queued_jobs: 4}};
  const notReady = (reason, draining = false) => ({...health, ready: false, reason, draining});
  const cases = [
    [null, null, '', false], [waiting, null, 'Waiting', false], [{jobs: {running: 1, queued: 3}}, health, 'Busy', false], [{jobs: {running: 0, queued: 0}}, health, 'Idle', false],
    [{jobs: {running: 0, queued: 4}}, health, 'Queue full', true], [waiting, notReady('disk: 5 bytes are free'), 'Disk full', true], [waiting, notReady('store: locked'), 'Store down', true],
    [waiting, notReady('worker: restarting'), 'Not ready', true], [waiting, notReady('draining', true), 'Stopping', true],
  ];
  for (const [queue, state, word, isBad] of cases) {
    const found = serviceState(queue, state);
    assert.deepEqual([found.word, found.isBad, found.help !== ''], [word, isBad, isBad]);
  }
  assert.match(serviceState(waiting, notReady('disk: 5 bytes are free')).help, /free, new jobs are refused below .*Remove jobs/);
});

test('PNGs of two small jobs are compared by the page', async () => {
  const {ownPng} = await load('compare-source.js');
  const job = (width, height, ...names) => ({image: {width, height}, artifacts: names.map((name) => ({name}))});
  const found = [ownPng(job(8000, 8000, 'image.png'), ''), ownPng(job(8000, 8001, 'image.png'), ''), ownPng(job(8, 8, 'image.exr'), ''),
                 ownPng(job(8, 8, 'image.png', 'image.exr'), 'image.exr'), ownPng({image: null, artifacts: []}, '')];
  assert.deepEqual(found.map((each) => !!each), [true, false, false, false, false]);
});

test('documents differ by pointer', async () => {
  const {documentDifference} = await load('pointers.js');
  const a = {ambient: 1, 'a/b': {'~': [1, 2]}, objects: [{radius: 1}, {radius: 2}]}, b = {'a/b': {'~': [1, 3]}, objects: [{radius: 1}, {radius: 3}], lights: []};
  assert.deepEqual(documentDifference(a, a), []);
  assert.deepEqual(documentDifference(a, b), [{pointer: '/ambient', a: '1', b: ''}, {pointer: '/a~1b/~0', a: '[1,2]', b: '[1,3]'},
                                              {pointer: '/objects/1/radius', a: '2', b: '3'}, {pointer: '/lights', a: '', b: '[]'}]);
});

test('a pointer leads to the value, or to what is around it', async () => {
  const {applied, changesTo, pointerAt, rangeOf, wholeRangeOf} = await load('pointers.js');
  const text = '{ "objects": [{"type": "box"}, {"a/b": 1, "~": [2, 30]}],  // kept\n "name": "x", "~1": 5 }';
  const cases = [['', '{'], ['#/objects/0/type', '"box"'], ['/objects/1/a~1b', '1'], ['#/objects/1/~0/1', '30'], ['/objects/1/~0', '['], ['/objects/0/radius', '{'],
                 ['/objects/7/radius', '['], ['/lights/0', '{'], ['#/objects/0/ty%70e', '"box"'], ['/~01', '5']];
  for (const [pointer, expected] of cases) {
    const {from, to} = rangeOf(text, pointer);
    assert.equal(text.slice(from, to), expected, pointer);
  }
  assert.deepEqual(rangeOf('', '/a'), {from: 0, to: 0});
  assert.equal(pointerAt(text, text.indexOf('30')), '/objects/1/~0/1');
  assert.equal(wholeRangeOf(text, ['lights']), null);
  assert.equal(applied(text, changesTo(text, ['objects', 1, '~'], [])), text.replace('[2, 30]', '[]'));
});

test('shares of the error are those of its square', async () => {
  const {shares} = await load('error-tab.js');
  const found = (estimate, sampling, approximation) => shares({estimate, parts: {sampling, approximation, depth: 9, cutoff: 9, tone: 0}}).map(({name, levels, share}) => [name, levels, share]);
  assert.deepEqual(found(13, 3, 4), [['sampling', 3, 9 / 169], ['truncation', 12, 144 / 169], ['approximation', 4, 16 / 169]]);
  assert.deepEqual(found(2.9999999, 3, 0), [['sampling', 3, 1], ['truncation', 0, 0], ['approximation', 0, 0]]);
  assert.deepEqual(found(0, 0, 0).map(([, , share]) => share), [0, 0, 0]);
});

test('the cheapest point within a limit is of the front', async () => {
  const {cheapest} = await load('measure.js');
  const points = [{seconds: 1, claimed: 8}, {seconds: 2, claimed: 4}, {seconds: 3, claimed: 0.1}, {seconds: 8, claimed: 1}];
  const measurement = {points, pareto_front: [0, 1, 3]};
  const cases = [['claimed', 4, 1], ['claimed', 1, 3], ['claimed', 0.5, -1], ['seconds', 7, 1], ['seconds', 8, 3], ['seconds', 0.5, -1]];
  for (const [limited, limit, expected] of cases) assert.equal(cheapest(measurement, limited, limit), expected, `${limited} ${limit}`);
});

test('a list that stays open forgets the jobs that it shows no longer', async () => {
  Object.assign(globalThis, {requestAnimationFrame: () => 1, cancelAnimationFrame: () => undefined});
  const {JobList} = await load('job-list.js');
  let read = 0;
  globalThis.fetch = async () => Response.json({items: Array.from({length: 200}, () => ({id: `job ${++read}`})), next_cursor: null});
  const list = new JobList({});
  for (let i = 0; i < 20; ++i) await list.reload();
  list.close();
  assert.equal(list.order.length, 200);
  assert.ok(read > 4000 && list.jobs.size <= 600, `${list.jobs.size} of ${read} jobs`);
});

test('each document keeps its own text in a tab, and that of no job is kept for others', async () => {
  const storage = () => {
    const texts = new Map();
    return {getItem: (key) => texts.get(key) ?? null, setItem: (key, text) => { if (text === 'too large') throw new Error(); texts.set(key, text); }, removeItem: (key) => texts.delete(key)};
  };
  const {storedText, storeText} = await load('job-source.js');
  Object.assign(globalThis, {sessionStorage: storage(), localStorage: storage()});
  storeText('', 'mine');
  storeText('a', 'of a');
  assert.deepEqual(['', 'a', 'b'].map(storedText), ['mine', 'of a', null]);
  globalThis.sessionStorage = storage();  // another tab
  assert.deepEqual(['', 'a'].map(storedText), ['mine', null]);
  storeText('', 'its own');
  globalThis.localStorage.setItem('whittle.text', 'of another tab');
  assert.equal(storedText(''), 'its own');
  storeText('', 'too large');
  assert.equal(storedText(''), null);
});

test('errors of models are upper limits, exact or unknown', async () => {
  const {errorText} = await load('measure-plot.js');
  const point = {model: 'whitted', error: 0.5, model_error: 34.6, total_error: null, upper_limits: ['error']};
  assert.deepEqual(['error', 'model_error', 'total_error'].map((name) => errorText(point, name)), ['≤ 0.5', '35', '']);
  assert.equal(errorText({...point, model: 'path'}, 'model_error'), '0');
});

const FIELDS = {
  sphere: 'center radius', plane: 'point normal', disc: 'center inner_radius', cylinder: 'from to caps', cone: 'apex apex_radius', box: 'min max', torus: 'major_radius minor_radius',
  triangle: 'vertices uvs', mesh: 'positions file', instance: 'of',
};
/** By the text around the cursor, where @ is what stands before it: labels that must be offered there. @type {[string, [string, string][]][]} */
const CURSORS = [
  ['@', [['{', 'version']]],
  ['{"version": 1, @', [
    ['"', 'camera objects lights materials accuracy output job'], ['"ca', 'camera'], ['"image": {"', 'width height crop'], ['"image": {"width": 8, "', 'height'],
    ['"camera": {"', 'position look_at fov aperture'], ['"camera": {"type": "', 'orthographic panorama'], ['"camera": {"position": [0, 0, 1], "', 'look_at up'],
    ['"background": {"', 'color'], ['"background": {"zenith": 1, "', 'nadir'], ['"depth_cue": {"', 'front back'], ['"lights": [{"', 'type'],
    ['"lights": [{"type": "', 'point directional spot'], ['"lights": [{"type": "point", "', 'position intensity color'], ['"lights": [{"type": "directional", "', 'direction']]],
  ['{"version": 1, "textures": {"a": {@', [
    ['"', 'checker gradient noise file'], ['"file": "a.png", "wrap": "', 'repeat clamp mirror'], ['"file": "a.png", "filter": "', 'nearest bilinear mipmap'],
    ['"file": "a.png", "color_space": "', 'srgb linear']]],
  ['{"version": 1, "materials": {"a": {@', [
    ['"', 'color diffuse specular reflection transmission ior emission'], ['"model": "', 'lambert phong blinn_phong'], ['"transparency": "', 'refract interpolated filtered'],
    ['"shading": "', 'smooth flat gouraud flat_polygon'], ['"re', 'reflection reflection_color'], ['"fresnel": ', 'true false'], ['"color": {"', 'checker noise'],
    ['"color": 1, "', 'shininess absorption normal_map bump']]],
  ['{"version": 1, "objects": [{@', [
    ['"', 'type'], ['"type": "', Object.keys(FIELDS).join(' ')], ['"type": "s', 'sphere'], ['"type": "t', 'torus triangle'],
    ...Object.entries(FIELDS).map(([shape, fields]) => [`"type": "${shape}", "`, fields]), ['"type": "sphere", "material": {"', 'color ior'],
    ['"type": "sphere", "material": {"model": "', 'phong'], ['"type": "sphere", "transform": [{"', 'translate rotate scale'],
    ['"type": "sphere", "radius": 1, "', 'center material shadow'], ['"type": "mesh", "smooth": ', 'true false'], ['"type": "cylinder", "caps": ', 'true false']]],
  ['{"version": 1, "accuracy": {@', [
    ['"', 'preset target_error time_budget_ms samples max_depth cutoff approximate'], ['"preset": "', 'draft standard fine reference'], ['"approximate": {"', 'shadows reflections'],
    ['"approximate": {"shadows": "', 'none'], ['"approximate": {"reflections": "', 'environment'], ['"target_error": 1, "', 'max_depth seed']]],
  ['{"version": 1, "output": {@', [
    ['"', 'formats exposure layers quality alpha'], ['"formats": ["', 'png exr jpg webp'], ['"formats": ["png", "', 'exr'],
    ['"layers": ["', 'depth normal albedo error samples'], ['"alpha": ', 'true false'], ['"half": ', 'true false']]],
  ['{"version": 1, "job": {@', [
    ['"', 'name labels priority run_after deadline webhook'], ['"cache": "', 'off'], ['"keep": ', 'true false'], ['"webhook": {"', 'url'], ['"priority": 1, "', 'max_attempts']]],
];

test('fields and values are offered at each position of the cursor', async () => {
  await import(`${process.env.WHITTLE_PAGE}/schema-worker.js`);
  globalThis.onmessage({data: {schema: JSON.parse(readFileSync(process.env.WHITTLE_SCHEMA, 'utf8'))}});
  const reply = (message) => new Promise((resolve) => { globalThis.postMessage = resolve; globalThis.onmessage({data: message}); });
  let positions = 0;
  for (const [around, cases] of CURSORS) {
    for (const [before, expected] of cases) {
      const text = around.replace('@', before), {result, error} = await reply({id: ++positions, method: 'complete', text, offset: text.length});
      assert.equal(error, undefined);
      const labels = result.map(({label}) => label.replaceAll('"', ''));
      assert.deepEqual(expected.split(' ').filter((label) => !labels.includes(label)), [], text);
    }
  }
  assert.ok(positions >= 60, `${positions}`);  // acceptance test 27
});

test('patches of a batch are shown by what they vary', async () => {
  const {patchText, sweepOfPatches, turntable, variedPointers} = await load('sweep.js');
  const ball = (radius) => [{type: 'sphere', radius}, {type: 'plane', normal: [0, 1, 0]}];
  const base = {camera: {fov: 30, position: [0, 1, 6], look_at: [0, 1, 0]}, objects: ball(1)};
  const job = (index) => ({job: {labels: {frame: `${index}`}}, name: `image ${index}`});
  // The first frame of a script is the scene itself: its patch lacks what the others change.
  const grid = [{...job(0)}, {...job(1), camera: {fov: 40}}, {...job(2), objects: ball(2)}, {...job(3), objects: ball(2), camera: {fov: 40}}];
  const cases = [
    [grid, {'/objects/0/radius': [1, 2], '/camera/fov': [30, 40]}],
    [grid.slice(0, 3), null],
    [[grid[0], grid[2], grid[1], grid[3]], {'/camera/fov': [30, 40], '/objects/0/radius': [1, 2]}],
    [[grid[3], grid[1], grid[2], grid[0]], {'/objects/0/radius': [2, 1], '/camera/fov': [40, 30]}],
    [[grid[0], grid[3], grid[1], grid[2]], null], [[grid[0], grid[0]], null],
    [[{'/camera/fov': 30}, {'/camera/fov': 40}, {'/camera/fov': 50}], {'/camera/fov': [30, 40, 50]}],
  ];
  for (const [patches, expected] of cases) assert.deepEqual(sweepOfPatches(patches, base), expected, JSON.stringify(patches));
  assert.deepEqual(variedPointers([grid[1], {camera: {fov: 50}}]), ['/camera/fov']);
  assert.deepEqual([patchText(grid[1]), patchText({'/camera/fov': 1 / 3}), patchText(null)], [['camera/fov 40'], ['camera/fov 0.33333'], []]);
  assert.deepEqual(turntable(base, 4), [[0, 1, 6], [-6, 1, 0], [0, 1, -6], [6, 1, 0]]);
  assert.equal(turntable({camera: {matrix: []}}, 4), null);
});

test('a document of one line is shown in lines, with its values as written', async () => {
  const {readable} = await load('pointers.js');
  const long = {version: 1, image: {width: 8, height: 6}, objects: Array.from({length: 4}, (_, i) => ({type: 'sphere', center: [i, 0, 1e-7], radius: 0.5}))};
  for (const value of [long, {}, [], {a: 'x\n"y"', b: []}, [long, [long]]]) assert.deepEqual(JSON.parse(readable(JSON.stringify(value))), value);
  assert.match(readable(JSON.stringify(long)), /^\{\n {2}"version": 1,\n {2}"image": \{"width": 8, "height": 6\},\n {2}"objects": \[\n {4}\{"type": "sphere", "center": \[0, 0, 1e-7\], /);
  assert.match(readable(JSON.stringify(long).replace('0.5', '0.500')), /"radius": 0\.500\}/);
  for (const text of ['{"a":\n 1}', '']) assert.equal(readable(text), text);
});

test('a link holds a text, and nothing else passes for one', async () => {
  const {linkTo, textOfLink} = await load('scenes.js');
  location.origin = 'http://127.0.0.1:8080';
  for (const text of ['{"name": "Ünï ∞ 😀"}', '{}', JSON.stringify(Array.from({length: 5000}, (_, i) => i % 7))]) {
    const link = await linkTo(text);
    assert.match(link, /^http:\/\/127\.0\.0\.1:8080\/#\/new\?text=[\w-]+$/);
    assert.equal(await textOfLink(link.split('text=')[1]), text);
  }
  assert.equal(await linkTo(Array.from({length: 60000}, (_, i) => Math.sin(i)).join()), '');
  for (const broken of ['', '!', 'AAAA', 'x'.repeat(70000)]) assert.equal(await textOfLink(broken), null, broken.slice(0, 9));
});

test('the live view follows numbers and colors, and nothing that changes what a scene needs', async () => {
  const {cameraOf, changesOf, colorOf} = await load('live/message.js');
  const lights = new Float32Array(4 * 7 * 4), materials = new Float32Array(4 * 12);
  const header = {materials: ['/materials/a~1b'], material_cells: 12, material_fields: {color: 0, reflection: 15, transmission: 19, ior: 31, specular: 33}, origin: [1, 0, 0], scale: 0.5, camera: {type: 'perspective', fov: 45, aperture: 0}};
  const live = () => ({header, tables: {materials: {columns: 4, rows: 12, values: materials.fill(9)}, lights: {columns: 4, rows: 28, values: lights}}});
  const before = {camera: {position: [0, 0, 5], look_at: [0, 0, 0]}, lights: [{type: 'point', position: [3, 0, 0]}, {type: 'directional', direction: [0, -1, 0]},
                  {type: 'spot', position: [0, 4, 0], direction: [0, -1, 0], inner_angle: 10, outer_angle: 20}, {type: 'line', from: [0, 3, 0], to: [1, 3, 0]}],
                  materials: {'a/b': {color: [1, 0, 0], reflection: 0.5, transmission: 0, ior: 1.5}}, objects: [{type: 'sphere', radius: 1}]};
  const changed = (change) => { const after = structuredClone(before); change(after); return changesOf(live(), before, after); };
  assert.deepEqual(changed((d) => { d.materials['a/b'].color = '#ff8000'; }), {camera: false, rows: [{table: 'materials', cell: 0, cells: 12}]});
  assert.deepEqual([...materials.slice(0, 4)].map((each) => each.toFixed(3)), ['1.000', '0.216', '0.000', '9.000']);
  assert.equal(changed((d) => { d.materials['a/b'].reflection = 0.25; }).rows.length, 1);
  assert.equal(materials[15], 0.25);
  changed((d) => { d.lights[0].position = [5, 2, 0]; d.lights[1].direction = [0, 0, -2]; });
  assert.deepEqual([...lights.slice(0, 3), ...lights.slice(36, 39)].map((each) => each + 0), [2, 1, 0, 0, 0, 1]);
  changed((d) => { d.lights[2].outer_angle = 60; d.lights[3].to = [5, 3, 2]; });
  assert.deepEqual([lights[71].toFixed(6), ...lights.slice(96, 99)], ['0.500000', 2.5, 0, 1]);
  assert.deepEqual(changed((d) => { d.camera.position = [1, 1, 1]; d.camera.aperture = 2; }), {camera: true, rows: []});
  for (const change of [
    (d) => { d.materials['a/b'].reflection = 0; }, (d) => { d.materials['a/b'].transmission = 0.5; }, (d) => { d.materials['a/b'].ior = 1; },
    (d) => { d.materials['a/b'].color = 'red'; }, (d) => { d.materials['a/b'].color = [1, -1, 0]; }, (d) => { d.materials['a/b'].specular = 1; },
    (d) => { d.objects[0].radius = 2; }, (d) => { d.objects.push({}); }, (d) => { d.lights[0].position = [1, 2]; }, (d) => { d.lights[3].from = null; }, (d) => { d.camera.up = [1, 0, 0]; },
  ]) {
    materials.fill(9);
    assert.equal(changed(change), null, String(change));
    assert.ok(materials.every((each) => each === 9), String(change));
  }
  assert.deepEqual(cameraOf(live(), {camera: {fov: 30, focus_distance: 4, up: 'x'}}), {type: 'perspective', fov: 30, aperture: 0, focus_distance: 4, up: 'x'});
  assert.deepEqual([colorOf(0.5), colorOf('#fff'), colorOf({hsb: [1, 1, 1]})], [[0.5, 0.5, 0.5], [1, 1, 1], null]);
});
