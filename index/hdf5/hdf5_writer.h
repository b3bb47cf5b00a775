// Hdf5Writer: writes an HDF5 file through filiform-hdf5 (hdf5_protocol.h), for circuits that filiform makes.
//
//   Hdf5Writer out("nodes.h5");
//   out.reals("nodes/column/0/x", "f64", 1, x);
//   out.finish();
//
// Thread rule: thread-compatible.
#pragma once

#include "index/errors.h"
#include "index/hdf5/hdf5_program.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace filiform {

class Hdf5Writer {
 public:
  // Replaces the file. All members throw IoError. Without finish(), the destructor removes the file.
  explicit Hdf5Writer(const std::string& path);
  ~Hdf5Writer();

  // Each writes an array of values.size() / width rows. Groups on the way to `name` are created. `type`, as stored: f64
  // or f32; i64, i32, u32 or i8. The same calls give the same bytes. O(values).
  void reals(const std::string& name, const std::string& type, std::uint32_t width, std::span<const double> values);
  void integers(const std::string& name, const std::string& type, std::uint32_t width,
                std::span<const std::int64_t> values);
  void texts(const std::string& name, const std::vector<std::string>& values);
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace filiform
