#include "index/hdf5/hdf5_writer.h"

#include "index/file/internal/bytes.h"
#include "index/hdf5/internal/hdf5_process.h"

namespace filiform {

struct Hdf5Writer::State {
  std::string path;
  internal::Hdf5Process process;

  void write(const std::string& name, const std::string& type, std::uint64_t width, std::uint64_t rows,
             internal::ByteSpan values) {
    process.ask(
        "write", path, {name, type, std::to_string(width), std::to_string(rows)},
        [](hdf5::RecordKind, internal::Hdf5Bytes) {}, values);
  }
};

Hdf5Writer::Hdf5Writer(const std::string& path) : state_(std::make_unique<State>()) {
  state_->path = path;
  state_->process.ask("create", path, {}, [](hdf5::RecordKind, internal::Hdf5Bytes) {});
}

Hdf5Writer::~Hdf5Writer() {
  if (state_) state_->process.close();
}

void Hdf5Writer::reals(const std::string& name, const std::string& type, std::uint32_t width,
                       std::span<const double> values) {
  internal::ByteWriter bytes;
  for (const double value : values) bytes.f64(value);
  state_->write(name, type, width, values.size() / width, bytes.bytes());
}

void Hdf5Writer::integers(const std::string& name, const std::string& type, std::uint32_t width,
                          std::span<const std::int64_t> values) {
  internal::ByteWriter bytes;
  for (const std::int64_t value : values) bytes.i64(value);
  state_->write(name, type, width, values.size() / width, bytes.bytes());
}

void Hdf5Writer::texts(const std::string& name, const std::vector<std::string>& values) {
  internal::ByteWriter bytes;
  for (const std::string& value : values) {
    bytes.u32(static_cast<std::uint32_t>(value.size()));
    bytes.text(value);
  }
  state_->write(name, "text", 1, values.size(), bytes.bytes());
}

void Hdf5Writer::finish() {
  state_->process.ask("finish", state_->path, {}, [](hdf5::RecordKind, internal::Hdf5Bytes) {});
}

}  // namespace filiform
