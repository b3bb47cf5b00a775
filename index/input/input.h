// Input: reads command-line arguments (files, folders, archives, addresses) as a stream of cells, and reports on every
// input.
//
// Cells come in the order of cell ids: by source, then by content digest, both in byte order. The order of the
// arguments has no effect, nor has the number of threads. One cell is in memory at a time, or the cells of one file; of
// an archive, its central directory. With several threads, small inputs are read ahead. Thread rule: thread-compatible;
// the functions of the caller are called on the calling thread.
//
//   Input input({"column.zip", "more/"});
//   for (Cell cell; input.next(cell);) std::cout << cell.source << '\n';
//   writeCheckTable(std::cout, input.reports());
#pragma once

#include "index/cell/cell.h"
#include "index/containers/versions.h"
#include "index/formats/swc.h"
#include "index/hdf5/hdf5_program.h"
#include "index/input/input_options.h"
#include "index/input/input_outcome.h"
#include "index/input/source_report.h"
#include "index/remote/remote_options.h"
#include "index/reports/input_report.h"

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

namespace internal {
struct InputState;
}

class Input : public CellStream {
 public:
  // Lists all inputs; reads only what lists the entries of containers. Folders are searched recursively, hidden files
  // included, for these endings in any letter case: .swc, .eswc, .swc.txt, .asc, the same with .gz, .zip, .tar,
  // .tar.gz, .tgz; .h5 if it holds morphologies; .json, .csv, .nml and .xml if they begin like MouseLight, CATMAID's
  // skeletons and NML. All other files, `._*` and what lies below `__MACOSX` are passed over: each has a row of
  // severity kPassed. A folder with an `info` of Neuroglancer skeletons counts as one input of skeletons.
  // index/containers/versions.h says which files of a folder are left out. Archives hold the same files, but no packed
  // ones.
  //
  // A file argument may have any name: *.zip, *.tar, *.tar.gz and *.tgz are archives; *.json is MouseLight; *.csv is a
  // table of CATMAID if its first line names skeleton_id or treenode_id; *.nml and *.xml are NML; *.h5 is one H5
  // morphology or a container of some, each an entry (read by internal::Hdf5Process, a program of its own); *.edges,
  // *.obj, *.vtk and *.asc are graphs (index/formats/internal/graph_file.h); endings of unread_formats.h are refused
  // (E_FORMAT); all others are SWC; a further .gz means that the file is packed. Graph files other than .asc inside
  // folders and archives are passed over, since such folders usually hold meshes. An argument that begins with http://,
  // https://, gs://, s3:// or precomputed:// is the folder of precomputed skeletons on a server, or of a volume whose
  // info names them.
  //
  // Symbolic links to files and folders are followed. Within one folder argument, each real file (device and inode, so
  // hard links too) is read once and each real folder is entered once, under its lowest path in byte order.
  //
  // Unreadable inputs are refused (E_UNREADABLE), and the rest continues: a file, an archive, a folder that cannot be
  // listed, a link without a target, a pipe or device named *.swc.
  //
  // Throws IoError if an argument is missing or neither file nor folder, if a server does not answer, or if the process
  // has no file descriptor or memory left. Throws InputError without arguments, or for a folder without any input;
  // UsageError for options that choose among skeletons, where there are none.
  // Calls `progress` with (0, 0) while it lists large containers.
  explicit Input(const std::vector<std::string>& arguments, InputOptions options = {});
  // The same from files of the caller's choice. Files that cannot be read are refused. Throws IoError if the process
  // has no file descriptor or memory left.
  explicit Input(std::span<const InputFile> files, InputOptions options = {});
  ~Input() override;
  Input(Input&&) noexcept;
  Input& operator=(Input&&) noexcept;

  // Moves the next cell that is not refused into `cell`; false at the end. The first pass refuses files that cannot be
  // read. A file of several cells gives them one after the other, by cell_parts.h; they have one source and digest.
  //
  // Throws IoError if a file changed since an earlier pass, cannot be read in a later pass, or if the process has no
  // file descriptor or memory left. Throws InputError if a cell exceeds the given memory. Throws ConservationError, and
  // UsageError as SwcReader does.
  bool next(Cell& cell) override;

  // From now on, a file is one cell, as with InputOptions::one_cell_a_file. Call it before the first next().
  void keepFilesWhole();

  // Returns to the first cell, for another pass. Refused inputs are not read again.
  void rewind();

  // For several processes that read the same inputs, each some of them. Call them before the first next().
  // The size of each input, bytes, in the order of sources(): stated or estimated.
  std::vector<std::uint64_t> sizes() const;
  // Keeps one of `count` consecutive parts of about equal size.
  void keepPart(unsigned part, unsigned count);
  // Leaves out the inputs outside these positions of sources(). Inputs with equal sources stay together: the range
  // begins and ends where the source changes, at or before `begin` and `end`.
  void keepOnly(std::uint64_t begin, std::uint64_t end);
  // Inputs that could not be read, and why: at listing, or so far.
  struct Unreadable {
    std::uint32_t row, entry;  // of reports(); UINT32_MAX: the row itself
    std::string source, reason;
  };
  std::vector<Unreadable> unreadable() const;
  // Why this process cannot read an input of another process; nullopt if it can. Reads it again.
  std::optional<std::string> tryToRead(const Unreadable& input);
  // After next() returned false: the reports on the inputs that this process has read, and what unitDoubt() needs of
  // them. takeReports() adds them to those of another process with the same inputs; call it in the order of parts.
  std::vector<std::uint8_t> encodeReports() const;
  void takeReports(std::span<const std::uint8_t> bytes);

  // Reports in the order of the arguments; within a folder by path. Final once next() has returned false.
  const std::vector<SourceReport>& reports() const;

  // Number of inputs that may hold a cell: files and .swc entries that are not refused at listing.
  std::uint64_t listed() const;
  // Their sources, in the order of cells. Valid while this object lives. O(listed()).
  std::vector<std::string_view> sources() const;
  // Approximate memory, bytes, of the lists of inputs and the reports. Records of reports are not included: they take
  // up to 1 MiB, and more go to a file. O(listed()).
  std::uint64_t held_bytes() const;
  // Approximate memory, bytes, of archives that further threads keep open until next() returns false.
  std::uint64_t reading_bytes() const;
  // Bytes of all files on disk.
  std::uint64_t bytes() const;
  // One line if the unit of the cells read so far looks wrong (index/cell/internal/unit_check.h); otherwise empty.
  std::string unitDoubt() const;

 private:
  using State = internal::InputState;
  std::unique_ptr<State> state_;
};

// Sums over the rows of a report.
struct InputTotals {
  std::uint64_t accepted = 0, warned = 0, skipped = 0, refused = 0;  // inputs, by InputFate
  std::map<std::string, std::uint64_t> passed_over;                  // files that are no inputs, by countedEnding()
  std::uint64_t bytes = 0, samples = 0, segments = 0, isolated = 0, roots = 0;
  CodeCounts codes;

  std::uint64_t inputs() const { return accepted + warned + skipped + refused; }
};
// "12 .txt, 3 .hoc (NEURON)": the most frequent endings first, at most 20 of them.
std::string passedOverText(const std::map<std::string, std::uint64_t>& passed_over);
InputTotals totals(const std::vector<SourceReport>& reports);

// True if anything of the row was dropped.
bool anyDropped(const SourceReport& row);
// Passes the dropped parts of a row to `use`, piece by piece, in order: comma-separated line numbers; for an archive,
// entry names or `entry:line`. Text is escaped. No piece is longer than a name.
void writeDropped(const SourceReport& row, const std::function<void(std::string_view piece)>& use);

// The worst severity of the rows; accept without rows. `check` exits with 1 if the verdict is refuse.
Severity verdict(const std::vector<SourceReport>& reports);
bool anyRefused(const std::vector<SourceReport>& reports);

// Writes a header line and `file severity samples segments dropped codes` for each row, tab-separated, names escaped.
void writeCheckTable(std::ostream& out, const std::vector<SourceReport>& reports);

// A few lines for the user: totals, each code with count, meaning and its first place, and the first 20 refused and
// skipped inputs with the reason. Ends with a newline.
std::string summary(const std::vector<SourceReport>& reports);

}  // namespace filiform
