// Modules of the web UI for tests in node, bundled as for browsers.
import {createRequire} from 'node:module';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';

export const packages = createRequire(join(process.env.TESSERA_PAGE_PACKAGES, 'index.js'));
const folder = join(dirname(fileURLToPath(import.meta.url)), '..', 'src');

// All exports of the named modules.
export async function sources(...names) {
  const {outputFiles: [{text}]} = await packages('esbuild').build({
    stdin: {contents: names.map((name) => `export * from './${name}';`).join('\n'), resolveDir: folder},
    bundle: true,
    write: false,
    format: 'esm',
    target: 'es2022',
    nodePaths: [process.env.TESSERA_PAGE_PACKAGES],
    logLevel: 'warning',
  });
  return import(`data:text/javascript;base64,${Buffer.from(text).toString('base64')}`);
}
