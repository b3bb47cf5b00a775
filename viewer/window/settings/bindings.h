// What keys and mouse do in the window, in one table. The input, the help in the window, `filiform view --keys` and the
// README's table all come from it. Pure; any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace filiform {

enum class Action : std::uint8_t {
  none,
  // the hand
  push_left,
  push_right,
  push_up,
  push_down,
  push_away,
  push_closer,
  toggle_free,
  centre,
  next_leap,
  // the view
  zoom_in,
  zoom_out,
  turn_left,
  turn_right,
  turn_up,
  turn_down,
  overview,
  orthographic,
  own_cell,
  next_colouring,
  next_palette,
  next_stereo,
  more_separation,
  less_separation,
  freeze,
  fullscreen,
  // travelling
  next_branch,
  previous_branch,
  next_sample,
  parent_sample,
  other_branch,
  nearest_tip,
  soma,
  back,
  forward,
  set_bookmark,
  go_to_bookmark,
  search,
  measure,
  jump_across,
  simulated_hand,
  neurite_tip,
  // cells
  isolate_cells,
  hide_cells,
  dim_cells,
  invert_cells,
  show_cells,
  // the window
  help,
  commands,
  panel_tiles,
  panel_force,
  panel_minimap,
  panel_settings,
  panel_cells,
  panel_contacts,
  panel_bookmarks,
  screenshot,
  screenshot_large,
  window_picture,
  save_view,
  close,
  quit,
  // mouse only
  rotate,
  pan,
  pull,
  pull_depth,
  jump,
  wheel_zoom,
  wheel_separation,
  choose_cell,
  neurite_menu,
};

// A key: the character that it types, or a special key that types none.
struct Key {
  enum Special : std::uint32_t {
    kNone = 0,
    kEscape = 0x110000,  // beyond Unicode
    kEnter,
    kTab,
    kBackspace,
    kLeft,
    kRight,
    kUp,
    kDown,
    kPageUp,
    kPageDown,
    kHome,
    kF1,
    kF11,
  };
  enum Modifier : std::uint8_t { kShift = 1, kControl = 2, kAlt = 4 };

  std::uint32_t code = kNone;  // the typed character (kShift is then not set), or a Special
  std::uint8_t modifiers = 0;
  friend bool operator==(const Key&, const Key&) = default;
};
std::string toString(const Key& key);  // "Alt+Left", "v", "Space"

// What a held key does.
enum class Held : std::uint8_t {
  once,     // acts when it is pressed only
  repeats,  // acts again at the keyboard's repeat rate
  pushes,   // acts until it is released
};
const char* toString(Held held);  // "repeats"; "" for once

struct Binding {
  Action action;
  const char* name;   // in the state file
  const char* group;  // heading in the help
  Key first, second;  // kNone: none
  const char* mouse;  // gesture; empty: none
  const char* what;   // what it does: a phrase that begins with a verb
  Held held = Held::once;
};

// In the order of the help, groups together.
std::span<const Binding> bindings();
const Binding& bindingOf(Action action);  // requires an action that is in the table
Action actionOf(const Key& key);          // Action::none: not bound
// The action of a key event. `repeated`: the key is held. Action::none: not bound, or a repeat of a key that acts once.
Action actionOf(const Key& key, bool repeated);
std::string inputsOf(const Binding& binding);  // "h, F1", "wheel"

// The table as Markdown, with a line feed at its end.
std::string bindingsInMarkdown();

}  // namespace filiform
