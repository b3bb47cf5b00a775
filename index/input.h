// From command-line arguments (files, folders, zip archives) to a stream of cells, and a report on every input.
//
// Cells come in the order of cell ids: by source, equal sources by content digest, both in byte order, whatever the
// order of the arguments. One cell is in memory at a time; of archives, the directory. Thread-compatible.
//
//   Input input({"column.zip", "more/"});
//   for (Cell cell; input.next(cell);) std::cout << cell.source << '\n';
//   writeCheckTable(std::cout, input.reports());
#pragma once

#include "index/cell.h"
#include "index/input_report.h"
#include "index/swc.h"

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

// One .swc of an archive, or an inner archive that was not opened.
struct EntryReport {
  std::string entry;  // its name, raw bytes
  std::uint64_t bytes = 0;
  std::uint64_t digest = 0;  // XXH3 of the content
  bool dropped = false;      // as a whole: skipped or refused
  InputReport report;
};

// One row of `check`: a file argument, a file of a folder, an archive with the sums over its entries, or a folder that
// cannot be listed.
struct SourceReport {
  std::string file;  // base name of the argument, or path below the folder argument; raw bytes
  bool archive = false;
  std::uint64_t bytes = 0;
  std::uint64_t digest = 0;  // XXH3 of the content; of an archive, of its central directory
  InputReport report;        // of an archive: sums, and records of the archive itself
  std::vector<EntryReport> entries;
};

struct InputOptions {
  SwcOptions swc;
  std::uint64_t memory = UINT64_MAX;  // bytes
  double cell_share = 0.625;          // of the memory, what one cell may take while it is read
  // Told after each block how many of the bytes (of files on disk) are done. What it throws ends the run.
  std::function<void(std::uint64_t done, std::uint64_t total)> progress;
};

class Input : public CellStream {
 public:
  // Lists everything; reads the directories of archives and nothing else. Folders are walked recursively, taking each
  // *.swc and *.zip in any letter case, hidden ones too, except `._*` and `__MACOSX`. A folder whose own `info` is that
  // of Neuroglancer skeletons is these skeletons and nothing else. An argument that is a file may be a link and have
  // any name; *.zip is an archive, *.edges, *.obj and *.vtk are graphs (index/graph_file.h), all else is SWC. Graph
  // files within folders and archives are not taken: such folders hold meshes as a rule.
  //
  // Symbolic links in folders are followed, to files and to folders. Within one folder argument each real file (device
  // and inode, so hard links too) is taken once, and each real folder is entered once, under its lowest path in byte
  // order; loops end there.
  //
  // What cannot be read is refused (E_UNREADABLE), and the rest goes on: a file, an archive, a folder that cannot be
  // listed, a link to nothing, a pipe or device named *.swc. Throws IoError when an argument is missing, or neither
  // file nor folder, or when the process has no file descriptor or memory left; InputError when there is no argument, a
  // folder holds neither .swc nor .zip.
  explicit Input(const std::vector<std::string>& arguments, InputOptions options = {});
  ~Input() override;
  Input(Input&&) noexcept;
  Input& operator=(Input&&) noexcept;

  // The next cell that is not refused. In the first pass, a file that cannot be read is refused. Throws IoError when a
  // file differs from an earlier pass, cannot be read in a later pass, or the process has no file descriptor or memory
  // left; InputError when a cell takes more memory than is given; ConservationError; UsageError as SwcReader.
  bool next(Cell& cell) override;

  // Starts over, for another pass. Inputs that were refused are not read again.
  void rewind();

  // In the order of the arguments, in a folder by path. Complete, and then unchanging, once next() has returned false.
  const std::vector<SourceReport>& reports() const;

  // .swc files and entries that may be read; the cells are these but for what is refused.
  std::uint64_t listed() const;
  // Of the same, in the order of cells. O(listed()); valid as long as the input.
  std::vector<std::string_view> sources() const;
  // About the memory that the lists of inputs and the reports on them take; each record of a report beside, a byte or
  // two beyond 1 MiB in all. O(listed()).
  std::uint64_t held_bytes() const;
  // Sum over the files on disk.
  std::uint64_t bytes() const;
  // One line where the unit of what was read so far looks wrong (index/unit_check.h), empty otherwise.
  std::string unitDoubt() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// What became of an input: a file, or what an archive holds. An entry that an archive loses is skipped as long as the
// archive itself is not refused. So an input is refused only where anyRefused() is true.
enum class InputFate : std::uint8_t { kAccepted, kWarned, kSkipped, kRefused };

struct InputTotals {
  std::uint64_t accepted = 0, warned = 0, skipped = 0, refused = 0;  // inputs, by InputFate
  std::uint64_t bytes = 0, samples = 0, segments = 0, isolated = 0, roots = 0;
  CodeCounts codes;
};
InputTotals totals(const std::vector<SourceReport>& reports);

// Was anything dropped of a row?
bool anyDropped(const SourceReport& row);
// Hands over, piece by piece, what was dropped of a row, in order: comma-separated line numbers, in an archive entry
// names or `entry:line`; escaped. A text of any length; no piece is longer than a name.
void writeDropped(const SourceReport& row, const std::function<void(std::string_view piece)>& use);

// The worst severity of the rows; accept where there is none. `check` exits with 1 where the verdict is refuse.
Severity verdict(const std::vector<SourceReport>& reports);
bool anyRefused(const std::vector<SourceReport>& reports);

// `file severity samples segments dropped codes`, tab-separated, under a header line; names escaped.
void writeCheckTable(std::ostream& out, const std::vector<SourceReport>& reports);

// A few lines for people: totals, each code with its count and meaning, each refused and each skipped input (the first
// 20 of both) with the reason. Ends with a newline.
std::string summary(const std::vector<SourceReport>& reports);

}  // namespace filiform
