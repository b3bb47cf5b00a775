#include "viewer/window/settings/internal/setting_actions.h"

#include "viewer/window/settings/internal/text_format.h"

#include <algorithm>
#include <cstddef>
#include <iterator>

namespace filiform::internal {

namespace {

template <class T, std::size_t N>
T next(T value, const T (&choices)[N]) {
  return choices[(static_cast<std::size_t>(value) + 1) % N];
}

void nextStereo(bool has_quad_buffer, Settings& settings, Messages& messages) {
  const bool is_last = settings.stereo == *std::rbegin(kStereoModes);
  if (is_last && has_quad_buffer)
    settings.stereo = StereoMode::quad_buffer;
  else if (settings.stereo == StereoMode::quad_buffer)
    settings.stereo = StereoMode::mono;
  else
    settings.stereo = next(settings.stereo, kStereoModes);
  messages.say(format(is_last && settings.stereo == StereoMode::mono
                          ? "stereo: %s (this display has no quad-buffer stereo)"
                          : "stereo: %s",
                      toString(settings.stereo)));
}

}  // namespace

void changeSeparation(double by, Settings& settings, Messages& messages) {
  settings.separation = std::clamp(settings.separation + by, 0.0, 2.0);
  messages.say(format("eye separation: %.1f", settings.separation));
}

bool changeSetting(Action action, bool has_quad_buffer, Settings& settings, Messages& messages) {
  switch (action) {
    case Action::panel_tiles:
      settings.show_tiles = !settings.show_tiles;
      return true;
    case Action::panel_minimap:
      settings.show_minimap = !settings.show_minimap;
      return true;
    case Action::next_colouring:
      settings.colouring = next(settings.colouring, kColourings);
      messages.say(format("coloured by %s", toString(settings.colouring)));
      return true;
    case Action::next_stereo:
      nextStereo(has_quad_buffer, settings, messages);
      return true;
    case Action::orthographic:
      settings.orthographic = !settings.orthographic;
      messages.say(settings.orthographic ? "orthographic view" : "perspective view");
      return true;
    case Action::own_cell:
      settings.own_cell = !settings.own_cell;
      messages.say(settings.own_cell ? "the other cells are dimmed" : "all cells are drawn alike");
      return true;
    case Action::next_palette:
      settings.orange_blue = !settings.orange_blue;
      messages.say(settings.orange_blue ? "fork: own branch orange, others blue"
                                        : "fork: own branch red, others green");
      return true;
    case Action::more_separation:
      changeSeparation(kSeparationStep, settings, messages);
      return true;
    case Action::less_separation:
      changeSeparation(-kSeparationStep, settings, messages);
      return true;
    default:
      return false;
  }
}

}  // namespace filiform::internal
