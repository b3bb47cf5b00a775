#include "tools/synthetic/synthetic_swc.h"

#include "tools/synthetic/thousandths.h"

#include <cstdint>
#include <utility>

#include <xxhash.h>

namespace filiform::tools {

std::string swcText(const Neuron& neuron, const std::vector<std::string>& comments) {
  std::string out;
  out.reserve(500 + neuron.samples.size() * 45);
  out += "# Synthetic, grown by filiform synth: not a reconstruction of a real cell\n";
  for (const std::string& comment : comments) out += "# " + comment + "\n";
  out += "# id type x y z radius parent\n";
  for (std::size_t i = 0; i < neuron.samples.size(); ++i) {
    const NeuronSample& sample = neuron.samples[i];
    appendInteger(out, i + 1);
    out += ' ';
    appendInteger(out, sample.type);
    for (const std::int64_t coordinate : sample.p_nm) {
      out += ' ';
      appendThousandths(out, coordinate);
    }
    out += ' ';
    appendThousandths(out, sample.radius_nm);
    out += ' ';
    if (sample.parent == kNoParent) {
      out += "-1";
    } else {
      appendInteger(out, std::uint64_t{sample.parent} + 1);
    }
    out += '\n';
  }
  return out;
}

Cell cellOf(const Neuron& neuron, const std::string& text, std::string source) {
  Cell out;
  out.source = std::move(source);
  out.digest = XXH3_64bits(text.data(), text.size());
  const std::size_t n = neuron.samples.size();
  out.sample_ids.reserve(n);
  out.positions_um.reserve(n);
  out.parents.reserve(n);
  out.radii_um.reserve(n);
  out.types.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    const NeuronSample& s = neuron.samples[i];
    out.sample_ids.push_back(static_cast<std::int64_t>(i) + 1);
    // A quotient of exact integers is the double nearest to the decimal: the value that a reader of the text gets.
    out.positions_um.emplace_back(static_cast<double>(s.p_nm[0]) / 1000, static_cast<double>(s.p_nm[1]) / 1000,
                                  static_cast<double>(s.p_nm[2]) / 1000);
    out.parents.push_back(s.parent);
    out.radii_um.push_back(static_cast<float>(static_cast<double>(s.radius_nm) / 1000));
    out.types.push_back(s.type);
  }
  return out;
}

}  // namespace filiform::tools
