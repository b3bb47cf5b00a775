// Circuits for tests: a small one that the caller fills, and the output of a command.
#pragma once

#include "index/hdf5/hdf5_writer.h"
#include "tests/support/temp_folder.h"

#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace filiform::test {

// What a shell line writes to standard output; empty if it fails.
inline std::string outputOf(const std::string& command) {
  std::string out;
  FILE* const pipe = ::popen(command.c_str(), "r");
  std::array<char, 4096> block{};
  for (std::size_t n = 0; (n = std::fread(block.data(), 1, block.size(), pipe)) > 0;) out.append(block.data(), n);
  return ::pclose(pipe) == 0 ? out : std::string();
}

// A circuit with one population, made by the caller.
class SmallCircuit {
 public:
  explicit SmallCircuit(const std::string& folder, const std::string& more = "") : folder_(folder) {
    std::filesystem::create_directories(folder);
    writeBytes(folder + "/a.swc", "1 1 0 0 0 5 -1\n2 4 0 10 0 1 1\n3 4 0 20 0 1 2\n");
    writeBytes(folder + "/off.swc", "1 1 100 0 0 5 -1\n2 4 100 10 0 1 1\n");
    writeBytes(config(), R"({"networks":{"nodes":[{"nodes_file":"nodes.h5","node_types_file":"types.csv",)" +
                             std::string(R"("populations":{"p":{"type":"biophysical","morphologies_dir":"."}}}]})") +
                             more + "}");
    writeBytes(
        folder + "/types.csv",
        "node_type_id morphology rotation_angle_zaxis ei\n7 a 1.5707963267948966 e\n8 NULL NULL i\n9 off NULL e\n");
  }
  std::string config() const { return folder_ + "/circuit_config.json"; }
  std::string nodes() const { return folder_ + "/nodes.h5"; }
  void write(const std::function<void(Hdf5Writer& out)>& fill) const {
    Hdf5Writer out(nodes());
    fill(out);
    out.finish();
  }

 private:
  std::string folder_;
};

inline void writePlaces(Hdf5Writer& out, std::size_t nodes) {
  const std::vector<double> none(nodes, 0);
  for (const char* const axis : {"x", "y", "z"}) out.reals(std::string("nodes/p/0/") + axis, "f64", 1, none);
}

}  // namespace filiform::test
