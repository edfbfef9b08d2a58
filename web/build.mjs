/**
 * Builds the page: `node build.mjs [FOLDER]`, by default into the Python package. The same sources give the same bytes
 * wherever they lie. What it writes is committed, so that an installation needs no node.
 */
import { createHash } from 'node:crypto';
import { chmod, mkdir, mkdtemp, readFile, readdir, rename, rm, writeFile } from 'node:fs/promises';
import path from 'node:path';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const here = path.dirname(fileURLToPath(import.meta.url));
const target = path.resolve(process.argv[2] ?? path.join(here, '../src/tribrach/workbench/static'));

/** What COPC asks for and the page does not use: it fetches for itself, and decodes in workers of its own. */
const unused = {
  name: 'unused',
  setup(it) {
    it.onResolve({ filter: /^(cross-fetch|laz-perf|fs)$/ }, (args) => ({ path: args.path, namespace: 'unused' }));
    it.onLoad({ filter: /.*/, namespace: 'unused' }, () => ({ contents: 'export default undefined; export const createLazPerf = undefined;' }));
  },
};

/** The decoder asks for these in node only. */
const browser = {
  name: 'browser',
  setup(it) {
    it.onResolve({ filter: /^(fs|path|url|crypto)$/ }, (args) => ({ path: args.path, namespace: 'browser' }));
    it.onLoad({ filter: /.*/, namespace: 'browser' }, () => ({ contents: 'export default {};' }));
  },
};

const common = {
  bundle: true, minify: true, target: ['es2022'], legalComments: 'none', charset: 'utf8', logLevel: 'warning',
  absWorkingDir: here, metafile: true, define: { 'process.env.NODE_ENV': '"production"' },
};

/** Files that the bundle is made from, for BUILD.json. */
async function sources(folder = '') {
  const out = [];
  for (const entry of await readdir(path.join(here, folder), { withFileTypes: true })) {
    const name = path.posix.join(folder, entry.name);
    if (entry.isDirectory()) {
      if (folder === '' && entry.name !== 'src') continue;
      out.push(...(await sources(name)));
    } else if (folder !== '' || /^(package(-lock)?\.json|build\.mjs|\.npmrc)$/.test(entry.name)) out.push(name);
  }
  return out.sort();
}

const digest = (bytes) => createHash('sha256').update(bytes).digest('hex');

/** Licences of everything whose code is in the bundle, in full. */
async function thirdParty(inputs) {
  const packages = new Set();
  for (const input of inputs) {
    const match = /node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(input);
    if (match) packages.add(match[1]);
  }
  const apache = await readFile(path.join(here, 'licences/Apache-2.0.txt'), 'utf8');
  const out = [
    'The page of tribrach view and tribrach workbench contains code of these packages.\n' +
      'Their licences follow in full.\n',
  ];
  for (const name of [...packages].sort()) {
    const folder = path.join(here, 'node_modules', name);
    const about = JSON.parse(await readFile(path.join(folder, 'package.json'), 'utf8'));
    const files = (await readdir(folder)).filter((file) => /^(licen[cs]e|notice|copying)/i.test(file)).sort();
    const texts = [];
    for (const file of files) texts.push((await readFile(path.join(folder, file), 'utf8')).trim());
    if (!texts.length) {
      // some packages name their licence and ship no text of it
      const own = await readFile(path.join(here, 'licences', `${name.replace('/', '_')}.txt`), 'utf8');
      texts.push(own.trim());
      if (about.license === 'Apache-2.0') texts.push(apache.trim());
    }
    const line = '='.repeat(100);
    out.push(`${line}\n${name} ${about.version} (${about.license})\n${line}\n\n${texts.join('\n\n')}\n`);
  }
  return out.join('\n');
}

const work = await mkdtemp(path.join(path.dirname(target), '.static-'));
try {
  const page = await build({
    ...common, entryPoints: { main: 'src/main.js' }, outdir: work, format: 'esm', platform: 'browser', plugins: [unused],
  });
  const style = await build({ ...common, entryPoints: { main: 'src/main.css' }, outdir: work });
  const worker = await build({
    ...common, entryPoints: { 'cloud-worker': 'src/cloud/worker.js' }, outdir: work, format: 'iife', platform: 'browser', plugins: [browser],
  });
  const inputs = [page, style, worker].flatMap((result) => Object.keys(result.metafile.inputs));
  await writeFile(path.join(work, 'THIRD_PARTY.txt'), await thirdParty([...inputs, 'node_modules/laz-perf/wasm']));
  for (const file of ['node_modules/laz-perf/lib/worker/laz-perf.wasm', 'src/index.html', 'src/icon.svg']) {
    await writeFile(path.join(work, path.basename(file)), await readFile(path.join(here, file)));
  }
  const made = {};
  for (const name of await sources()) made[name] = digest(await readFile(path.join(here, name)));
  for (const name of (await readdir(path.join(here, 'licences'))).sort()) {
    made[`licences/${name}`] = digest(await readFile(path.join(here, 'licences', name)));
  }
  const outputs = {};
  for (const name of (await readdir(work)).sort()) outputs[name] = digest(await readFile(path.join(work, name)));
  await writeFile(path.join(work, 'BUILD.json'), `${JSON.stringify({ sources: made, files: outputs }, null, 1)}\n`);
  await rm(target, { recursive: true, force: true });
  await mkdir(path.dirname(target), { recursive: true });
  await chmod(work, 0o755);
  await rename(work, target);
} catch (error) {
  await rm(work, { recursive: true, force: true });
  throw error;
}
