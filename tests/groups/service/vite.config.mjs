// Bundles Neuroglancer with the data source `precomputed` alone.
import {existsSync} from 'node:fs';
import {createRequire} from 'node:module';
import {dirname, join} from 'node:path';

const packages = process.cwd();
const require = createRequire(join(packages, 'package.json'));
// The published package of icons lacks some that Neuroglancer names; the tests need no picture of them.
const blank = '\0blank.svg';
const missingIcons = {
  name: 'missing-icons',
  enforce: 'pre',
  resolveId(id) {
    const icon = id.match(/ikonate\/icons\/([a-z0-9-]+)\.svg/);
    if (!icon) return null;
    const folder = join(packages, 'node_modules/ikonate/icons');
    return existsSync(join(folder, icon[1] + '.svg')) ? null : blank;
  },
  load: (id) => (id === blank ? 'export default "<svg xmlns=\'http://www.w3.org/2000/svg\'/>"' : null),
};
const conditions = [
  'neuroglancer/datasource:none_by_default', 'neuroglancer/datasource/precomputed:enabled',
  'neuroglancer/kvstore:none_by_default', 'neuroglancer/kvstore/http:enabled', 'neuroglancer/kvstore/gzip:enabled',
  'module', 'browser', 'production'
];

export default {
  base: './',
  resolve: {conditions},
  plugins: [missingIcons],
  worker: {format: 'es', plugins: () => [missingIcons]},
  build: {
    outDir: join(packages, 'dist'), emptyOutDir: true, target: 'es2022', chunkSizeWarningLimit: 10000,
    rollupOptions: {input: join(packages, 'neuroglancer.html')}
  },
};
