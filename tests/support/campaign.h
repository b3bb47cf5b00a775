// Short and whole campaigns: `tools/test` runs a sample, `tools/test --long` runs everything and collects the lines
// that begin with "campaign: ".
#pragma once

#include <cstdlib>
#include <iostream>
#include <string>

namespace filiform::test {

// `tools/test --long` sets FILIFORM_CAMPAIGN.
inline bool wholeCampaign() { return std::getenv("FILIFORM_CAMPAIGN") != nullptr; }

// Prints a row of the table of counts.
inline void tell(const std::string& counts) { std::cout << "campaign: " << counts << std::endl; }

}  // namespace filiform::test
