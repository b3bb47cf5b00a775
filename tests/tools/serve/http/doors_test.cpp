// The service as others use it: every route against its description; the page and the door for Neuroglancer in
// Chromium.
#include "tests/support/folders.h"
#include "tests/support/sanitized.h"
#include "tests/support/servers/served_column.h"
#include "tests/support/variable.h"

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

class Doors : public test::ServedColumn {
 protected:
  Doors() : ServedColumn(6) {}
  void SetUp() override {
    if (test::kSanitized) GTEST_SKIP() << "other programs as clients, once is enough";
    ServedColumn::SetUp();
  }
  static bool has(const std::string& command) { return std::system((command + " >/dev/null 2>&1").c_str()) == 0; }
  static std::string script(const char* name) { return test::inSource("tests/groups/service/") + name; }
};

TEST_F(Doors, EveryRouteFitsItsDescription) {
  if (!has("/usr/bin/python3 -c 'import jsonschema'")) GTEST_SKIP() << "needs python3-jsonschema";
  const std::string token = "0123456789abcdef0123456789abcdef";
  test::writeBytes(folder_ / "token", token + "\n");
  const std::string page = folder_ / "page";  // a made-up page for travel
  std::filesystem::create_directory(page);
  for (const char* const name : {"travel.js", "travel.css", "reader.js", "filiform.js", "filiform.worker.js",
                                 "filiform.wasm", "filiform.wasm.gz"})
    test::writeBytes(page + "/" + name, "page");
  const test::Variable web("FILIFORM_WEB", page);
  const test::ServerProcess open({set_}, folder_ / "err");
  const test::ServerProcess closed({set_, "--token-file", folder_ / "token"}, folder_ / "err2");
  const std::string check = "/usr/bin/python3 " + script("openapi_check.py") + " ";
  for (const std::string& line : {check + open.address() + " t", check + closed.address() + " t " + token}) {
    const std::string printed = shell(line);
    EXPECT_TRUE(printed.ends_with("routes fit their description\n")) << printed;
  }
  EXPECT_EQ(test::readBytes(folder_ / "err2").find(token), std::string::npos);
}

TEST_F(Doors, NeuroglancerShowsTheSet) {
  const char* const named = std::getenv("FILIFORM_SERVICE_PACKAGES");
  const char* const home = std::getenv("HOME");
  const std::string packages =
      named != nullptr ? named : std::string(home != nullptr ? home : "") + "/.cache/filiform/service";
  if (!has("command -v node") || !has("command -v chromium") ||
      !std::filesystem::exists(packages + "/dist/neuroglancer.html"))
    GTEST_SKIP() << "needs node, chromium and the packages of tools/setup --service";
  const std::string out = folder_ / "browser";
  std::filesystem::create_directory(out);
  const std::string printed =
      shell("timeout 400 node " + script("neuroglancer_test.mjs") + " '" + packages + "' \"$(command -v chromium)\" '" +
            test::filiformProgram().string() + "' '" + set_ + "' '" + out + "'");
  EXPECT_TRUE(printed.starts_with("Neuroglancer: 6 skeletons, ") && printed.ends_with("\n")) << printed;
}

}  // namespace
}  // namespace filiform
