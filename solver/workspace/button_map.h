// What the buttons of a device do: names for the command line, defaults for devices with few buttons, and the file that
// `filiform devices --setup` writes. Thread rule: functions without state.
#pragma once

#include "device/haptic_device.h"
#include "index/errors.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace filiform {

enum class ButtonAction : std::uint8_t {
  none,
  toggle_mode,  // to free mode at once; to constrained mode by the commanding thread, which finds the place
  centre,
  zoom_in,   // halves the zoom
  zoom_out,  // doubles the zoom
  back,      // by the commanding thread, which has the history
  forward,   // likewise
  turn,  // while held: as carry, and the scene turns with the stylus, about x and y through the proxy (the paper, 4)
  turn_moving,  // as turn, but the hand moves the proxy on
  carry,        // while held: the hand carries the scene along; no force acts, and the proxy stays at its place in it
  zoom,         // a click zooms in; held, it zooms out until it is released
  mode_turn,    // a click is toggle_mode; held, it is turn, and a roll of the stylus zooms (clockwise: in)
};

// The action of button i.
using ButtonMap = std::array<ButtonAction, 8>;

// The name of an action, as in parseButtons().
const char* toString(ButtonAction action);
// All names, for help texts: "mode, centre, ...".
std::string buttonActionNames();

// Reads NUMBER=ACTION, separated by commas; other buttons do nothing. Throws UsageError, with `where` in front, for
// another form, an unknown action, a button above 7, or two actions for a button.
ButtonMap parseButtons(const std::string& text, const std::string& where = "--buttons");
std::string buttonsText(const ButtonMap& map);  // as parseButtons() reads it

// The map for a device that nobody set up. A stylus with one button: mode_turn; with two: zoom, mode_turn; with three
// or more: mode, turn, zoom or zoom in and out. Other devices: mode, centre, zoom in, zoom out; zoom if they have
// three.
ButtonMap defaultButtons(const DeviceCapabilities& can);
// Throws UsageError if the map names a button that the device lacks.
void requireButtons(const ButtonMap& map, const DeviceCapabilities& can);

// $XDG_CONFIG_HOME/filiform/buttons.json, or the same path below ~/.config. Throws UsageError if neither variable is an
// absolute path.
std::string buttonsFile();
// The map in the file for the device of this name; nullopt if there is none. Throws InputError, which names the file,
// if the file is damaged.
std::optional<ButtonMap> savedButtons(const std::string& device_name);
// Writes the map of a device; those of others stay. Throws as savedButtons(), and IoError.
void saveButtons(const std::string& device_name, const ButtonMap& map);

}  // namespace filiform
