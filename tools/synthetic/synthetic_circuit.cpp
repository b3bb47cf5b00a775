#include "tools/synthetic/synthetic_circuit.h"

#include "index/errors.h"
#include "index/hdf5/hdf5_writer.h"
#include "tools/synthetic/synthetic_neuron.h"
#include "tools/words/making/output_folder.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace filiform::tools {

namespace {

constexpr double kCircuitRadius_um = 257;  // as placements of a library
constexpr std::uint32_t kVirtualNodes = 20;
constexpr const char* kContainer = "morphologies/merged-morphologies.h5";
constexpr const char* kConfig = R"({
  "version": 2.3,
  "manifest": {
    "$BASE_DIR": ".",
    "$MORPHOLOGIES": "$BASE_DIR/morphologies"
  },
  "components": {"morphologies_dir": ""},
  "networks": {
    "nodes": [
      {
        "nodes_file": "$BASE_DIR/column/nodes.h5",
        "populations": {
          "column": {
            "type": "biophysical",
            "alternate_morphologies": {"h5v1": "$MORPHOLOGIES/merged-morphologies.h5"}
          }
        }
      },
      {
        "nodes_file": "$BASE_DIR/input/nodes.h5",
        "populations": {"input": {"type": "virtual"}}
      }
    ],
    "edges": []
  }
}
)";

// What a circuit says of a morphology.
struct Kind {
  std::string mtype, morph_class, synapse_class;
  std::int64_t layer = 0;
  double depth_um = 0;  // y of the soma
};

struct Library {
  std::vector<Kind> kinds;
  std::vector<std::string> names;
};

Kind kindOf(const Neuron& neuron, std::uint64_t seed, std::uint64_t number) {
  static const std::vector<std::array<std::string, 2>> kShort{
      {"thick-tufted", "TTPC"},  {"slender-tufted", "STPC"}, {"star pyramidal", "SP"}, {"pyramidal", "PC"},
      {"spiny stellate", "SSC"}, {"Martinotti", "MC"},       {"neurogliaform", "NGC"}, {"basket", "BC"}};
  Kind kind;
  kind.layer = layerOfCell(seed, number);
  std::string type = "CELL";
  for (const auto& [word, abbreviation] : kShort)
    if (neuron.description.find(word) != std::string::npos) {
      type = abbreviation;
      break;
    }
  kind.mtype = "L" + std::to_string(kind.layer) + "_" + type;
  const bool interneuron = type == "MC" || type == "NGC" || type == "BC";
  kind.morph_class = interneuron ? "INT" : type == "SSC" ? "STEL" : "PYR";
  kind.synapse_class = interneuron ? "INH" : "EXC";
  kind.depth_um = static_cast<double>(neuron.samples.front().p_nm[1]) / 1000;
  return kind;
}

// Writes a neuron with its soma at the origin: a contour, then sections that begin with the last point of their parent.
class MorphologyWriter {
 public:
  MorphologyWriter(const Neuron& neuron, Hdf5Writer& out, const std::string& name) : neuron_(neuron) {
    const auto& samples = neuron.samples;
    children_.resize(samples.size());
    for (std::uint32_t i = 0; i < samples.size(); ++i)
      if (samples[i].parent != kNoParent) children_[samples[i].parent].push_back(i);
    structure_ = {0, 1, -1};
    const double radius_um = static_cast<double>(samples[0].radius_nm) / 1000;
    for (const auto& [x, y] : kContour) points_.insert(points_.end(), {x * radius_um, y * radius_um, 0, 0});
    for (std::uint32_t i = 0; i < samples.size(); ++i)
      if (samples[i].type != 1 && samples[samples[i].parent].type == 1) addTree(i);
    out.reals(name + "/points", "f32", 4, points_);
    out.integers(name + "/structure", "i32", 3, structure_);
    out.integers(name + "/metadata/version", "u32", 1, std::vector<std::int64_t>{1, 1});
  }

 private:
  // A regular octagon; only square roots, so that it is the same everywhere.
  static constexpr double kHalf = 0.70710678118654752440;
  static constexpr std::array<std::array<double, 2>, 8> kContour{
      {{1, 0}, {kHalf, kHalf}, {0, 1}, {-kHalf, kHalf}, {-1, 0}, {-kHalf, -kHalf}, {0, -1}, {kHalf, -kHalf}}};

  void addPoint(std::uint32_t sample) {
    const NeuronSample& s = neuron_.samples[sample];
    for (std::size_t axis = 0; axis < 3; ++axis)
      points_.push_back(static_cast<double>(s.p_nm[axis] - neuron_.samples[0].p_nm[axis]) / 1000);
    points_.push_back(static_cast<double>(2 * s.radius_nm) / 1000);
  }

  void addTree(std::uint32_t root) {
    std::vector<std::pair<std::uint32_t, std::int64_t>> open{{root, -1}};  // first new sample, parent section
    while (!open.empty()) {
      auto [sample, parent] = open.back();
      open.pop_back();
      const auto section = static_cast<std::int64_t>(structure_.size() / 3);
      structure_.insert(structure_.end(),
                        {static_cast<std::int64_t>(points_.size() / 4), neuron_.samples[sample].type, parent});
      if (parent >= 0) addPoint(neuron_.samples[sample].parent);
      addPoint(sample);
      while (children_[sample].size() == 1 &&
             neuron_.samples[children_[sample][0]].type == neuron_.samples[sample].type) {
        sample = children_[sample][0];
        addPoint(sample);
      }
      for (auto child = children_[sample].rbegin(); child != children_[sample].rend(); ++child)
        open.push_back({*child, section});
    }
  }

  const Neuron& neuron_;
  std::vector<std::vector<std::uint32_t>> children_;
  std::vector<double> points_;
  std::vector<std::int64_t> structure_;
};

// A column of texts, stored as entries of a library.
void writeCoded(Hdf5Writer& out, const std::string& group, const std::string& name,
                const std::vector<std::string>& values) {
  std::map<std::string, std::int64_t> places;
  for (const std::string& value : values) places.emplace(value, 0);
  std::vector<std::string> library;
  for (auto& [text, place] : places) {
    place = static_cast<std::int64_t>(library.size());
    library.push_back(text);
  }
  std::vector<std::int64_t> codes;
  for (const std::string& value : values) codes.push_back(places[value]);
  out.texts(group + "@library/" + name, library);
  out.integers(group + name, "u32", 1, codes);
}

void writeColumnNodes(const SyntheticOptions& options, const Library& library, const std::string& path) {
  std::vector<std::string> morphology, mtype, morph_class, synapse_class;
  std::vector<double> x, y, z, w, about_y;
  std::vector<std::int64_t> layer;
  for (std::uint64_t i = 0; i < options.cells; ++i) {
    const Kind& kind = library.kinds[i % library.kinds.size()];
    SyntheticRandom random(options.seed ^ 0x63697263756974U, i);
    const Vector3d place = kCircuitRadius_um * random.inDisc();
    Vector3d turn = random.inDisc();
    while (turn.squaredNorm() < 0.01) turn = random.inDisc();
    turn.normalize();
    x.push_back(place.x());
    y.push_back(kind.depth_um + random.between(-6, 0));
    z.push_back(place.z());
    w.push_back(turn.x());
    about_y.push_back(turn.z());
    layer.push_back(kind.layer);
    morphology.push_back(library.names[i % library.names.size()]);
    mtype.push_back(kind.mtype);
    morph_class.push_back(kind.morph_class);
    synapse_class.push_back(kind.synapse_class);
  }
  const std::vector<double> none(options.cells, 0);
  const std::string group = "nodes/column/0/";
  Hdf5Writer out(path);
  out.integers("nodes/column/node_type_id", "i64", 1, std::vector<std::int64_t>(options.cells, -1));
  out.reals(group + "x", "f64", 1, x);
  out.reals(group + "y", "f64", 1, y);
  out.reals(group + "z", "f64", 1, z);
  out.reals(group + "orientation_w", "f64", 1, w);
  out.reals(group + "orientation_x", "f64", 1, none);
  out.reals(group + "orientation_y", "f64", 1, about_y);
  out.reals(group + "orientation_z", "f64", 1, none);
  out.integers(group + "layer", "i32", 1, layer);
  out.texts(group + "morphology", morphology);
  writeCoded(out, group, "mtype", mtype);
  writeCoded(out, group, "morph_class", morph_class);
  writeCoded(out, group, "synapse_class", synapse_class);
  writeCoded(out, group, "model_type", std::vector<std::string>(options.cells, "biophysical"));
  out.finish();
}

void writeInputNodes(const SyntheticOptions& options, const std::string& path) {
  SyntheticRandom random(options.seed, 0x696e707574U);
  std::vector<double> x, y, z;
  for (std::uint32_t i = 0; i < kVirtualNodes; ++i) {
    const Vector3d place = kCircuitRadius_um * random.inDisc();
    x.push_back(place.x());
    y.push_back(-100);
    z.push_back(place.z());
  }
  Hdf5Writer out(path);
  out.integers("nodes/input/node_type_id", "i64", 1, std::vector<std::int64_t>(kVirtualNodes, -1));
  out.reals("nodes/input/0/x", "f64", 1, x);
  out.reals("nodes/input/0/y", "f64", 1, y);
  out.reals("nodes/input/0/z", "f64", 1, z);
  writeCoded(out, "nodes/input/0/", "model_type", std::vector<std::string>(kVirtualNodes, "virtual"));
  out.finish();
}

}  // namespace

SyntheticSummary writeSyntheticCircuit(const SyntheticOptions& options, const std::string& folder,
                                       const SyntheticProgress& progress) {
  if (options.cells == 0) throw UsageError("a circuit needs at least one cell");
  if (options.library == 0) throw UsageError("a library needs at least one morphology");
  OutputFolder made(folder);
  for (const char* const inner : {"column", "input", "morphologies"}) made.makeFolder(inner);
  SyntheticSummary summary;
  summary.cells = options.cells;
  const std::uint32_t morphologies = std::min(options.cells, options.library);
  Library library;
  const std::string container = folder + "/" + kContainer;
  for (const char* const file : {kContainer, "column/nodes.h5", "input/nodes.h5"}) made.note(file);
  Hdf5Writer out(container);
  for (std::uint32_t i = 0; i < morphologies; ++i) {
    const Neuron neuron = growNeuron(options.seed, i, true);
    library.kinds.push_back(kindOf(neuron, options.seed, i));
    std::string number = std::to_string(i);
    number.insert(0, 5 - std::min<std::size_t>(5, number.size()), '0');
    library.names.push_back("cell_" + number);
    MorphologyWriter(neuron, out, library.names.back());
    ++summary.files;
    summary.samples += neuron.samples.size();
    summary.segments += neuron.samples.size() - 1;
    if (progress) progress(summary.files, morphologies);
  }
  out.finish();
  writeColumnNodes(options, library, folder + "/column/nodes.h5");
  writeInputNodes(options, folder + "/input/nodes.h5");
  made.write("circuit_config.json", kConfig);
  std::error_code ignored;
  summary.zip_bytes = std::filesystem::file_size(container, ignored);
  made.finish();
  return summary;
}

}  // namespace filiform::tools
