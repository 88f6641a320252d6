// What is dropped onto the page: files, and the files of folders, which a browser gives one level at a time.
const kHidden = /^\./;

export const kEndings = [".csv", ".tsv", ".txt", ".dat", ".asc", ".log", ".gz", ".mat", ".h5", ".hdf5", ".npz", ".npy", ".bag", ".db3", ".mcap"];
// Of a folder other files are left out, but for the one that says which column is which: the workbench says what to do
// with it.
function isWanted(name: string): boolean { return name === "dataset.toml" || kEndings.some((ending) => name.toLowerCase().endsWith(ending)); }

function fileOf(entry: FileSystemFileEntry): Promise<File> {
  return new Promise((resolve, reject) => entry.file(resolve, reject));
}

// A reader gives at most a hundred entries at a time.
async function entriesOf(folder: FileSystemDirectoryEntry): Promise<FileSystemEntry[]> {
  const reader = folder.createReader(), all: FileSystemEntry[] = [];
  for (;;) {
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (!some.length) return all;
    all.push(...some);
  }
}

// Has to be called while the event is handled: its items are gone afterwards. Of folders within a folder nothing is taken,
// as by the commands.
export async function droppedFiles(transfer: DataTransfer | null): Promise<File[]> {
  const files = Array.from(transfer?.files ?? []);
  const entries = Array.from(transfer?.items ?? []).map((item) => item.webkitGetAsEntry?.() ?? null);
  if (!entries.some((entry) => entry?.isDirectory)) return files;
  const all: File[] = [], empty: string[] = [];
  for (const entry of entries) {
    if (entry?.isFile) all.push(await fileOf(entry as FileSystemFileEntry));
    if (!entry?.isDirectory) continue;
    const inside = (await entriesOf(entry as FileSystemDirectoryEntry)).filter((e) => e.isFile && !kHidden.test(e.name) && isWanted(e.name)).sort((a, b) => (a.name < b.name ? -1 : 1));
    for (const one of inside) all.push(await fileOf(one as FileSystemFileEntry));
    if (!inside.length) empty.push(entry.name);
  }
  if (empty.length) throw new Error(`There is no recording in ${empty.map((name) => `the folder ${name}`).join(", ")}: drop the files themselves, or the folder that they are in (${kEndings.join(", ")}).`);
  return all;
}
