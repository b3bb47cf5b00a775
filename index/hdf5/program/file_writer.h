// FileWriter: writes one HDF5 file after the other. Only file_writer.cpp and file_reader.cpp know the HDF5 library.
#pragma once

#include "index/hdf5/program/record_pipe.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform::hdf5 {

// Members throw Failure. A file that is not finished is removed. Thread rule: one in a process.
class FileWriter {
 public:
  FileWriter() = default;
  FileWriter(const FileWriter&) = delete;
  FileWriter& operator=(const FileWriter&) = delete;
  ~FileWriter();

  void create(const std::string& path);
  // `request`: as index/hdf5/internal/hdf5_protocol.h states. Always reads all blocks of values.
  void write(const std::vector<std::string>& request, RecordPipe& pipe);
  void finish();

 private:
  std::string path_;
  std::int64_t file_ = -1;  // hid_t
};

}  // namespace filiform::hdf5
