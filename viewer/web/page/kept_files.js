// Keeps the files of the window, which are bookmarks and settings, in the browser: an item of localStorage a file.
'use strict';

const kKept = 'filiform:';  // before the path
const kKeptFolders = ['/config/filiform', '/config/filiform/places'];

const kept = new Map();  // path to text, as in the browser

// Calls `told` with one line if nothing can be read.
function restoreFiles(told) {
  for (const folder of kKeptFolders) FS.mkdirTree(folder);
  try {
    for (const key of Object.keys(localStorage)) {
      const path = key.slice(kKept.length);
      if (!key.startsWith(kKept) || !kKeptFolders.includes(path.slice(0, path.lastIndexOf('/')))) continue;
      kept.set(path, localStorage.getItem(key));
      FS.writeFile(path, kept.get(path));
    }
  } catch (failure) {
    told('what this browser kept cannot be read: ' + failure.message);
  }
}

function keepFiles(told) {
  for (const folder of kKeptFolders)
    for (const name of FS.readdir(folder)) {
      const path = folder + '/' + name;
      if (!name.endsWith('.json') || !FS.isFile(FS.stat(path).mode)) continue;
      const text = FS.readFile(path, {encoding: 'utf8'});
      if (text === kept.get(path)) continue;
      kept.set(path, text);
      try {
        localStorage.setItem(kKept + path, text);
      } catch (failure) {
        told('bookmarks and settings cannot be kept in this browser: ' + failure.message);
      }
    }
}
