#include "index/hdf5/program/file_writer.h"

#include <cstdlib>
#include <cstring>
#include <hdf5.h>
#include <unistd.h>
#include <utility>

namespace filiform::hdf5 {
namespace {

std::uint32_t lengthAt(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | static_cast<unsigned char>(bytes[at + static_cast<std::size_t>(i)]);
  return value;
}

std::vector<std::string> textsOf(const std::string& bytes) {
  std::vector<std::string> texts;
  for (std::size_t at = 0; at + 4 <= bytes.size();) {
    const std::uint32_t length = lengthAt(bytes, at);
    if (length > bytes.size() - at - 4) throw Failure("a text to write is cut short");
    texts.push_back(bytes.substr(at + 4, length));
    at += 4 + length;
  }
  return texts;
}

// A type of the library for the name of one; -1: there is none.
hid_t typeOf(const std::string& name) {
  if (name == "f64") return H5T_IEEE_F64LE;
  if (name == "f32") return H5T_IEEE_F32LE;
  if (name == "i64") return H5T_STD_I64LE;
  if (name == "i32") return H5T_STD_I32LE;
  if (name == "u32") return H5T_STD_U32LE;
  if (name == "i8") return H5T_STD_I8LE;
  return -1;
}

}  // namespace

FileWriter::~FileWriter() {
  if (file_ < 0) return;
  H5Fclose(file_);
  ::unlink(path_.c_str());
}

void FileWriter::create(const std::string& path) {
  if (file_ >= 0) throw Failure("another file is being written");
  path_ = path;
  file_ = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  if (file_ < 0) throw Failure("cannot be written");
}

void FileWriter::write(const std::vector<std::string>& request, RecordPipe& pipe) {
  std::string bytes;
  for (std::string block; pipe.readBlock(block);) bytes += block;
  if (file_ < 0) throw Failure("no file is being written");
  const std::string& path = request[1];
  const std::uint64_t width = std::strtoull(request[3].c_str(), nullptr, 10);
  const std::uint64_t rows = std::strtoull(request[4].c_str(), nullptr, 10);
  const hsize_t dims[2] = {rows, width};
  const hid_t space = H5Screate_simple(width == 1 ? 1 : 2, dims, nullptr);
  const hid_t links = H5Pcreate(H5P_LINK_CREATE);
  H5Pset_create_intermediate_group(links, 1);
  const hid_t dataset = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_obj_track_times(dataset, false);  // the same values give the same bytes
  const bool text = request[2] == "text";
  hid_t type = typeOf(request[2]);
  if (text) {
    type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, H5T_VARIABLE);
    H5Tset_cset(type, H5T_CSET_UTF8);
  }
  herr_t done = -1;
  const hid_t set = type < 0 ? -1 : H5Dcreate2(file_, path.c_str(), type, space, links, dataset, H5P_DEFAULT);
  if (set >= 0 && text) {
    const std::vector<std::string> texts = textsOf(bytes);
    std::vector<const char*> pointers;
    for (const std::string& one : texts) pointers.push_back(one.c_str());
    if (pointers.size() == rows * width) done = H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, pointers.data());
  } else if (set >= 0 && bytes.size() == rows * width * 8) {
    const hid_t memory = request[2][0] == 'f' ? H5T_IEEE_F64LE : H5T_STD_I64LE;
    done = H5Dwrite(set, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data());
  }
  if (set >= 0) H5Dclose(set);
  if (text) H5Tclose(type);
  H5Pclose(dataset);
  H5Pclose(links);
  H5Sclose(space);
  if (done < 0) throw Failure("'" + path.substr(0, 200) + "' cannot be written");
}

void FileWriter::finish() {
  if (file_ < 0) throw Failure("no file is being written");
  const hid_t file = static_cast<hid_t>(std::exchange(file_, -1));
  const bool flushed = H5Fflush(file, H5F_SCOPE_GLOBAL) >= 0;
  if (H5Fclose(file) < 0 || !flushed) throw Failure("cannot be written: is the disk full?");
}

}  // namespace filiform::hdf5
