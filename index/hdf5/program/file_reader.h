// FileReader: one HDF5 file, a circuit's nodes or morphologies. Only file_reader.cpp knows the HDF5 library.
#pragma once

#include "index/hdf5/program/record_pipe.h"

#include <cstdint>
#include <string>

namespace filiform::hdf5 {

inline constexpr std::uint64_t kMostLinks = 20'000'000;  // of all groups together: under a minute

// What a file may claim; Failure beyond it. A hostile file may refer to one array, or one group, from many places.
struct Budget {
  std::uint64_t bytes = 0;  // of all datasets
  std::uint64_t links = kMostLinks;
};

// Members write the records that index/hdf5/internal/hdf5_protocol.h states, without the last one. They throw Failure.
//
// Nothing outside the file is read: external links, external storage, virtual datasets and filter plug-ins are refused.
// Datasets that claim more than 1100 times the bytes of the file together, the most that deflate can pack, are refused
// before memory is taken for them; so is a file with more than kMostLinks links, or with groups that contain
// themselves. Thread rule: one at a time in a process.
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
  Budget budget_;
};

}  // namespace filiform::hdf5
