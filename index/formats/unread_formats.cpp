#include "index/formats/unread_formats.h"

#include "index/text.h"

#include <algorithm>

namespace filiform {
namespace {

struct UnreadFormat {
  std::string_view ending, name;
};

constexpr std::size_t kLongestEnding = 12;  // bytes, after the dot

constexpr UnreadFormat kUnread[] = {
    {".hoc", "NEURON"},
    {".nrn", "NEURON"},
    {".neu", "NEURON, as the TREES toolbox writes"},
    {".mtr", "TREES toolbox"},
    {".am", "Amira"},
    {".amiramesh", "Amira"},
    {".nrx", "HBP reconstruction"},
    {".morphml", "MorphML"},
    {".neuroml", "NeuroML"},
    {".nts", "Eutectic"},
    {".eut", "Eutectic"},
    {".ama", "Amaral"},
    {".anat", "Nevin"},
    {".imx", "Imaris"},
    {".ims", "Imaris"},
    {".traces", "SNT"},
    {".ndf", "NeuronJ"},
    {".tck", "MRtrix tracks"},
    {".trk", "TrackVis tracks"},
    {".vtp", "VTK in XML"},
    {".vtu", "VTK in XML"},
    {".graphml", "GraphML"},
    {".nwb", "NWB"},
    {".ply", "mesh"},
    {".stl", "mesh"},
    {".drc", "mesh"},
};

std::string_view fileName(std::string_view path) {
  return path.substr(path.find_last_of("/\\") + 1);  // npos + 1 is 0
}

}  // namespace

std::string_view unreadFormat(std::string_view file_name) {
  for (const UnreadFormat& format : kUnread)
    if (endsWithNoCase(file_name, format.ending)) return format.name;
  return {};
}

std::string countedEnding(std::string_view path) {
  const std::string_view name = fileName(path);
  if (name.starts_with("._")) return "._*";
  const std::size_t dot = name.rfind('.');
  if (dot == std::string_view::npos || dot == 0) return "no ending";
  const std::string ending = lowerCase(name.substr(dot));
  const auto is_plain = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-'; };
  const bool plain = ending.size() > 1 && ending.size() <= kLongestEnding + 1 &&
                     std::all_of(ending.begin() + 1, ending.end(), is_plain);
  return plain ? ending : "no ending";
}

std::string whyPassedOver(std::string_view path) {
  const std::string ending = countedEnding(path);
  if (ending == "._*") return "a resource fork of macOS";
  if (const std::string_view format = unreadFormat(ending); !format.empty())
    return std::string(format) + " (" + ending + "), which filiform does not read";
  for (const std::string_view holds : {".json", ".h5", ".csv", ".nml", ".xml"})
    if (ending == holds) return "holds no cell that filiform reads";
  for (const std::string_view graph : {".edges", ".obj", ".vtk"})
    if (ending == graph) return "a graph, which is read only if the file is named";
  if (ending == ".gz") return "packed; only .swc.gz, .asc.gz and .tar.gz are read";
  return "no format of neurons that filiform reads";
}

std::string whyNotRead(std::string_view file_name) {
  const std::string_view format = unreadFormat(file_name);
  if (format.empty()) return {};
  return "the format " + std::string(format) + " (" + countedEnding(file_name) +
         ") is not read; convert the file to SWC with the program that wrote it";
}

}  // namespace filiform
