// FileReader: one HDF5 file, a circuit's nodes or morphologies. Only file_reader.cpp knows the HDF5 library.
#pragma once

#include "tools/hdf5/record_pipe.h"

#include <cstdint>
#include <string>

namespace filiform::hdf5 {

// Members write the records that index/input/hdf5_protocol.h states, without the last one. They throw Failure.
//
// Nothing outside the file is read: external links, external storage, virtual datasets and filter plug-ins are refused.
// A dataset that claims more than 1100 times the bytes of the file, the most that deflate can pack, is refused before
// memory is taken for it. Thread rule: one at a time in a process.
class FileReader {
 public:
  static void prepare();  // once, before the first file
  explicit FileReader(const std::string& path);
  FileReader(const FileReader&) = delete;
  FileReader& operator=(const FileReader&) = delete;
  ~FileReader();

  void morphologies(RecordPipe& pipe);
  void morphology(const std::string& name, RecordPipe& pipe);
  void populations(RecordPipe& pipe);
  void population(const std::string& name, RecordPipe& pipe);

 private:
  std::int64_t file_;  // hid_t
  std::uint64_t bytes_ = 0;
};

}  // namespace filiform::hdf5
