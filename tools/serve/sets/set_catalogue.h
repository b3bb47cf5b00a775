// The file of --catalogue: the sets to serve, in TOML. A table is a set, and its name the set's name:
//
//   [column]
//   address = "s3://sets/lab/column.fil"    # or a folder; relative ones begin at the catalogue's folder
//   token-file = "/etc/filiform/store"      # of the source; default: that of --source-token-file
//   budget = "2GiB"                         # of memory; default: a part of what the others leave of --budget
//   readers = ["ann", "*@lab.example"]      # who may see it: names or patterns of people; default: everybody
//
// Functions without state.
#pragma once

#include "tools/serve/sets/set_shelf.h"

#include <string>
#include <vector>

namespace filiform::tools {

// In the order of the names. `remote`: how sets at an address are read. Throws IoError if a file cannot be read, and
// UsageError, with the line, for a file that is no such catalogue.
std::vector<ShelfEntry> readCatalogue(const std::string& path, const RemoteOptions& remote = {});

}  // namespace filiform::tools
