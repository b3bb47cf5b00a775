// The module filiform._render: pictures of a set without a display. A module of its own, because it needs OpenGL.
#include "index/errors.h"
#include "solver/workspace/workspace.h"
#include "tools/python/internal/arguments.h"
#include "tools/python/internal/calls.h"
#include "tools/python/internal/open_set.h"
#include "viewer/gl/scene_view.h"

#include <numbers>
#include <optional>
#include <pybind11/stl.h>
#include <string>

namespace filiform::python {

namespace {

struct WantedPicture {
  PictureSize size;
  std::optional<std::pair<Vector3d, Vector3d>> box;  // to frame
  std::optional<Vector3d> proxy_W;
  double zoom_um;
  double yaw_rad, pitch_rad;
  std::optional<std::pair<Vector3d, Vector3d>> look;  // from, to
  std::optional<std::uint32_t> highlight;
  ColourBy colour;
  bool orthographic;
  std::uint64_t segments;
};

Picture draw(const OpenSet& open, const WantedPicture& wanted) {
  const auto context = makeOffscreenContext();
  Renderer renderer(*context);
  SceneView scene(open.set(), open.levels(), renderer);
  SceneFrame frame;
  frame.size = wanted.size;
  frame.colour = wanted.colour;
  frame.orthographic = wanted.orthographic;
  if (wanted.highlight) frame.cells = {*wanted.highlight};
  frame.budget.segments = wanted.segments;
  const double aspect = wanted.size.aspect();
  std::optional<Workspace> workspace;
  if (wanted.proxy_W) {
    workspace.emplace(WorkspaceOptions{.zoom_um = wanted.zoom_um});
    workspace->place(*wanted.proxy_W, workspace->centre_D());
    frame.workspace = &*workspace;
    frame.proxy_W = wanted.proxy_W;
  }
  if (wanted.look)
    frame.camera = fitDepth(lookAt(wanted.look->first, wanted.look->second), scene.lo_W(), scene.hi_W());
  else if (workspace)
    frame.camera = orbit(workspaceCamera(*workspace, aspect), wanted.yaw_rad, wanted.pitch_rad);
  else if (wanted.box)
    frame.camera = fitDepth(overview(wanted.box->first, wanted.box->second, wanted.yaw_rad, wanted.pitch_rad, aspect),
                            scene.lo_W(), scene.hi_W());
  else
    frame.camera = overview(scene.usual_lo_W(), scene.usual_hi_W(), wanted.yaw_rad, wanted.pitch_rad, aspect);
  SignalCheck check;
  scene.drawWhole(frame, [&](std::size_t, std::size_t) {
    for (int i = 0; i < 16; ++i) check();
  });
  return renderer.read();
}

std::optional<std::pair<Vector3d, Vector3d>> twoPoints(const char* name, py::handle value) {
  if (value.is_none()) return {};
  const PointsArgument points = pointsArgument(name, value);
  if (points.outer_shape != std::vector<py::ssize_t>{2})
    throw py::value_error(std::string(name) + ": expected two points, shape (2, 3)");
  return std::pair(points.points[0], points.points[1]);
}

int sideArgument(const char* name, py::handle value) {
  const std::int64_t side = integerArgument(name, value);
  if (side < 1 || side > Renderer::kMaxSize)
    throw py::value_error(std::string(name) + ": each side is 1 to " + std::to_string(Renderer::kMaxSize) + " pixels");
  return static_cast<int>(side);
}

ColourBy colourArgument(const std::string& name) {
  if (const auto colour = colouringNamed(name)) return *colour;
  throw py::value_error("colour_by: choose one of cell, type, depth, radius, tile");
}

// (height, width, 3), uint8.
py::array render(const std::shared_ptr<OpenSet>& open, py::handle width, py::handle height, py::handle box,
                 py::handle proxy, py::handle zoom, py::handle yaw_deg, py::handle pitch_deg, py::handle look,
                 std::optional<std::uint32_t> highlight, const std::string& colour_by, bool orthographic,
                 py::handle segments) {
  WantedPicture wanted{.size = {sideArgument("size", width), sideArgument("size", height)},
                       .box = twoPoints("box", box),
                       .proxy_W = {},
                       .zoom_um = numberArgument("zoom", zoom),
                       .yaw_rad = numberArgument("camera", yaw_deg) * std::numbers::pi / 180,
                       .pitch_rad = numberArgument("camera", pitch_deg) * std::numbers::pi / 180,
                       .look = twoPoints("camera", look),
                       .highlight = highlight,
                       .colour = colourArgument(colour_by),
                       .orthographic = orthographic,
                       .segments = countArgument("segments", segments, 1)};
  if (!proxy.is_none()) wanted.proxy_W = pointArgument("proxy", proxy);
  if (!(wanted.zoom_um >= Workspace::kMinZoom_um && wanted.zoom_um <= Workspace::kMaxZoom_um))
    throw py::value_error("zoom: is out of range");
  auto* picture = new Picture;
  const py::capsule owner(picture, [](void* p) { delete static_cast<Picture*>(p); });
  {
    const py::gil_scoped_release released;
    *picture = draw(*open, wanted);
  }
  return py::array_t<std::uint8_t>({py::ssize_t{picture->height}, py::ssize_t{picture->width}, py::ssize_t{3}},
                                   picture->rgb.data(), owner);
}

}  // namespace

}  // namespace filiform::python

PYBIND11_MODULE(_render, module) {
  module.doc() = "The compiled part of filiform.render. Use the package filiform.";
  pybind11::module_::import("filiform._core");  // its classes and errors
  module.def("render", &filiform::python::render);
}
