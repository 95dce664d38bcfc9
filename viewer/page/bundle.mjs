// node bundle.mjs NODE_MODULES OUTPUT: bundles the web UI into one compressed HTML file that fetches nothing
// at run time.
import {readFileSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';
import {gzipSync} from 'node:zlib';

const [packages, output] = process.argv.slice(2);
const source = join(dirname(fileURLToPath(import.meta.url)), 'src');
const esbuild = createRequire(join(packages, 'index.js'))('esbuild');

async function bundle(entry) {
  const result = await esbuild.build({
    entryPoints: [join(source, entry)],
    bundle: true,
    minify: true,
    write: false,
    format: 'iife',
    target: 'es2022',
    nodePaths: [packages],
    legalComments: 'inline',
    logLevel: 'warning',
  });
  return result.outputFiles[0].text;
}

const script = (await bundle('main.js')).replaceAll('</script', '<\\/script');
const style = await bundle('style.css');
const html = readFileSync(join(source, 'index.html'), 'utf8')
                 .replace('<!--style-->', () => `<style>${style}</style>`)
                 .replace('<!--script-->', () => `<script>${script}</script>`);
writeFileSync(output, gzipSync(html, {level: 9}));
