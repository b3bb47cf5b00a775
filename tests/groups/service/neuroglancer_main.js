// The released Neuroglancer as a page. Tests read its state from `viewer`.
import 'neuroglancer';

import {setupDefaultViewer} from 'neuroglancer/unstable/ui/default_viewer_setup.js';

globalThis.viewer = setupDefaultViewer();
