#include "viewer/window/settings/bindings.h"

#include <algorithm>
#include <array>

namespace filiform {

namespace {

constexpr Key key(std::uint32_t code, int modifiers = 0) { return {code, static_cast<std::uint8_t>(modifiers)}; }
constexpr Key kNoKey{};

constexpr std::array kBindings{
    Binding{Action::pull, "pull", "Hand", kNoKey, kNoKey, "right drag, left drag from proxy",
            "pull the proxy along its neurite; the line shows the force"},
    Binding{Action::pull_depth, "pull-depth", "Hand", kNoKey, kNoKey, "Shift + right drag, up and down",
            "push the hand away from you, or pull it closer"},
    Binding{Action::push_left, "push-left", "Hand", key(Key::kLeft), kNoKey, "", "push the hand to the left",
            Held::pushes},
    Binding{Action::push_right, "push-right", "Hand", key(Key::kRight), kNoKey, "", "push the hand to the right",
            Held::pushes},
    Binding{Action::push_up, "push-up", "Hand", key(Key::kUp), kNoKey, "", "push the hand up", Held::pushes},
    Binding{Action::push_down, "push-down", "Hand", key(Key::kDown), kNoKey, "", "push the hand down", Held::pushes},
    Binding{Action::push_away, "push-away", "Hand", key(Key::kPageUp), kNoKey, "", "push the hand away from you",
            Held::pushes},
    Binding{Action::push_closer, "push-closer", "Hand", key(Key::kPageDown), kNoKey, "", "push the hand towards you",
            Held::pushes},
    Binding{Action::toggle_free, "toggle-free", "Hand", key('f'), kNoKey, "",
            "free the hand, or put it on the nearest neurite"},
    Binding{Action::centre, "centre", "Hand", key(' '), kNoKey, "", "centre workspace and view on the proxy"},
    Binding{Action::next_leap, "next-leap", "Hand", key('z'), kNoKey, "",
            "let the proxy leap far, a little or not at all along its cell, in turn"},
    Binding{Action::simulated_hand, "tour", "Hand", key('t'), kNoKey, "",
            "let a simulated hand travel to the cell's farthest tip, or stop it"},
    Binding{Action::neurite_tip, "neurite-tip", "Hand", key('T'), kNoKey, "",
            "let it travel to the farthest tip of the same type"},

    Binding{Action::next_branch, "next-branch", "Travel", key('v'), kNoKey, "", "go to the next branch point or tip"},
    Binding{Action::previous_branch, "previous-branch", "Travel", key('b'), kNoKey, "",
            "go to the previous branch point or root"},
    Binding{Action::next_sample, "next-sample", "Travel", key(']'), kNoKey, "",
            "go to the next sample, away from the root", Held::repeats},
    Binding{Action::parent_sample, "parent-sample", "Travel", key('['), kNoKey, "", "go to the parent sample",
            Held::repeats},
    Binding{Action::other_branch, "other-branch", "Travel", key(Key::kTab), kNoKey, "",
            "go into the fork's other branches, in turn"},
    Binding{Action::nearest_tip, "nearest-tip", "Travel", key('r'), kNoKey, "",
            "go to the nearest tip; press again for the next nearest"},
    Binding{Action::soma, "soma", "Travel", key('u'), kNoKey, "", "go to the cell's root"},
    Binding{Action::jump, "jump", "Travel", kNoKey, kNoKey, "double click", "jump to the neurite under the pointer"},
    Binding{Action::search, "search", "Travel", key('/'), kNoKey, "", "go to a cell, CELL:soma, CELL:ID, or X Y Z"},
    Binding{Action::back, "back", "Travel", key(Key::kBackspace), key(Key::kLeft, Key::kAlt), "",
            "go back to the place before the last jump"},
    Binding{Action::forward, "forward", "Travel", key(Key::kRight, Key::kAlt), kNoKey, "", "go forward again"},
    Binding{Action::set_bookmark, "set-bookmark", "Travel", key(';'), kNoKey, "",
            "bookmark this place: type a letter next"},
    Binding{Action::go_to_bookmark, "go-to-bookmark", "Travel", key('\''), kNoKey, "",
            "go to a bookmark: type its letter next"},
    Binding{Action::jump_across, "jump-across", "Travel", key('j'), kNoKey, "",
            "jump across the nearest of the contacts that are marked; press again to jump back"},
    Binding{Action::measure, "measure", "Travel", key('x'), kNoKey, "",
            "measure the path from here; press again to stop"},

    Binding{Action::rotate, "rotate", "View", kNoKey, kNoKey, "left drag", "turn the scene about the proxy"},
    Binding{Action::pan, "pan", "View", kNoKey, kNoKey, "middle drag, Shift + left drag",
            "shift the view; Space centres it again"},
    Binding{Action::turn_left, "turn-left", "View", key(Key::kLeft, Key::kControl), kNoKey, "",
            "turn the scene to the left", Held::repeats},
    Binding{Action::turn_right, "turn-right", "View", key(Key::kRight, Key::kControl), kNoKey, "",
            "turn the scene to the right", Held::repeats},
    Binding{Action::turn_up, "turn-up", "View", key(Key::kUp, Key::kControl), kNoKey, "", "turn the scene up",
            Held::repeats},
    Binding{Action::turn_down, "turn-down", "View", key(Key::kDown, Key::kControl), kNoKey, "", "turn the scene down",
            Held::repeats},
    Binding{Action::wheel_zoom, "wheel-zoom", "View", kNoKey, kNoKey, "wheel", "zoom about the proxy"},
    Binding{Action::zoom_in, "zoom-in", "View", key('+'), key('='), "", "zoom in", Held::repeats},
    Binding{Action::zoom_out, "zoom-out", "View", key('-'), kNoKey, "", "zoom out", Held::repeats},
    Binding{Action::overview, "overview", "View", key('o'), key(Key::kHome), "",
            "show the scene, then also its far cells if it has any, then the workspace again"},
    Binding{Action::orthographic, "orthographic", "View", key('a'), kNoKey, "",
            "switch between orthographic and perspective view"},
    Binding{Action::own_cell, "own-cell", "View", key('d'), kNoKey, "",
            "dim the other cells and see yours through them, or draw all alike"},
    Binding{Action::next_colouring, "next-colouring", "View", key('c'), kNoKey, "",
            "colour by cell, type, depth, radius or tile, in turn"},
    Binding{Action::next_palette, "next-palette", "View", key('g'), kNoKey, "",
            "colour the fork red and green, or orange and blue"},
    Binding{Action::next_stereo, "next-stereo", "View", key('s'), kNoKey, "", "select the next stereo mode"},
    Binding{Action::wheel_separation, "wheel-separation", "View", kNoKey, kNoKey, "Ctrl + wheel",
            "change the eye separation"},
    Binding{Action::more_separation, "more-separation", "View", key('.'), kNoKey, "", "increase the eye separation",
            Held::repeats},
    Binding{Action::less_separation, "less-separation", "View", key(','), kNoKey, "", "decrease the eye separation",
            Held::repeats},
    Binding{Action::freeze, "freeze", "View", key('l'), kNoKey, "", "freeze the levels of detail, or release them"},
    Binding{Action::fullscreen, "fullscreen", "View", key(Key::kF11), kNoKey, "", "switch full screen on or off"},

    Binding{Action::choose_cell, "choose-cell", "Cells", kNoKey, kNoKey, "click, Ctrl + click, Shift + click",
            "choose the cell; Ctrl: add or remove it; Shift: add it"},
    Binding{Action::neurite_menu, "neurite-menu", "Cells", kNoKey, kNoKey, "right click",
            "choose the cell, and show a menu about the neurite"},
    Binding{Action::isolate_cells, "isolate-cells", "Cells", key('I'), kNoKey, "",
            "show the chosen cells alone, or else yours"},
    Binding{Action::hide_cells, "hide-cells", "Cells", key('H'), kNoKey, "", "hide the chosen cells, or else yours"},
    Binding{Action::dim_cells, "dim-cells", "Cells", key('D'), kNoKey, "",
            "dim the chosen cells, or else yours, or show them again"},
    Binding{Action::invert_cells, "invert-cells", "Cells", key('!'), kNoKey, "",
            "show the hidden cells and hide the others"},
    Binding{Action::show_cells, "show-cells", "Cells", key('A'), kNoKey, "", "show all cells"},

    Binding{Action::help, "help", "Window", key('h'), key(Key::kF1), "", "show or hide this help"},
    Binding{Action::commands, "commands", "Window", key('p', Key::kControl), kNoKey, "",
            "find a command by its words, and do it"},
    Binding{Action::panel_tiles, "panel-tiles", "Window", key('\\'), kNoKey, "", "show or hide tile map and memory"},
    Binding{Action::panel_force, "panel-force", "Window", key('k'), kNoKey, "", "show or hide the force plot"},
    Binding{Action::panel_minimap, "panel-minimap", "Window", key('m'), kNoKey, "", "show or hide the minimap"},
    Binding{Action::panel_settings, "panel-settings", "Window", key('e'), kNoKey, "", "show or hide the settings"},
    Binding{Action::panel_cells, "panel-cells", "Window", key('n'), kNoKey, "", "show or hide the table of cells"},
    Binding{Action::panel_contacts, "panel-contacts", "Window", key('i'), kNoKey, "",
            "find, mark and list the contacts of your cell, or hide them"},
    Binding{Action::panel_bookmarks, "panel-bookmarks", "Window", key('B'), kNoKey, "", "show or hide the bookmarks"},
    Binding{Action::screenshot, "screenshot", "Window", key('p'), kNoKey, "", "save a picture of the scene"},
    Binding{Action::screenshot_large, "screenshot-large", "Window", key('P'), kNoKey, "",
            "save a picture of the scene, three times as large"},
    Binding{Action::window_picture, "window-picture", "Window", key('w'), kNoKey, "",
            "save a picture of the window with its panels"},
    Binding{Action::save_view, "save-view", "Window", key('V'), kNoKey, "",
            "save this view as a file for --view, and copy the command"},
    Binding{Action::close, "close", "Window", key(Key::kEscape), kNoKey, "",
            "close the top panel; cancel a picture; stop the simulated hand"},
    Binding{Action::quit, "quit", "Window", key('q'), key('q', Key::kControl), "", "quit"},
};

}  // namespace

std::string toString(const Key& key) {
  std::string text;
  if ((key.modifiers & Key::kControl) != 0) text += "Ctrl+";
  if ((key.modifiers & Key::kAlt) != 0) text += "Alt+";
  if ((key.modifiers & Key::kShift) != 0) text += "Shift+";
  switch (key.code) {
    case Key::kNone:
      return "";
    case Key::kEscape:
      return text += "Esc";
    case Key::kEnter:
      return text += "Enter";
    case Key::kTab:
      return text += "Tab";
    case Key::kBackspace:
      return text += "Backspace";
    case Key::kLeft:
      return text += "Left";
    case Key::kRight:
      return text += "Right";
    case Key::kUp:
      return text += "Up";
    case Key::kDown:
      return text += "Down";
    case Key::kPageUp:
      return text += "PageUp";
    case Key::kPageDown:
      return text += "PageDown";
    case Key::kHome:
      return text += "Home";
    case Key::kF1:
      return text += "F1";
    case Key::kF11:
      return text += "F11";
    case ' ':
      return text += "Space";
    default:
      return text += static_cast<char>(key.code);  // bindings are ASCII
  }
}

const char* toString(Held held) {
  switch (held) {
    case Held::repeats:
      return "repeats";
    case Held::pushes:
      return "pushes";
    case Held::once:
      break;
  }
  return "";
}

std::span<const Binding> bindings() { return kBindings; }

const Binding& bindingOf(Action action) {
  return *std::find_if(kBindings.begin(), kBindings.end(), [&](const Binding& b) { return b.action == action; });
}

Action actionOf(const Key& key) {
  if (key.code == Key::kNone) return Action::none;
  for (const Binding& binding : kBindings)
    if (binding.first == key || binding.second == key) return binding.action;
  return Action::none;
}

Action actionOf(const Key& key, bool repeated) {
  const Action action = actionOf(key);
  if (!repeated || action == Action::none || bindingOf(action).held == Held::repeats) return action;
  return Action::none;
}

std::string inputsOf(const Binding& binding) {
  std::string text;
  const auto add = [&](const std::string& more) {
    if (more.empty()) return;
    if (!text.empty()) text += ", ";
    text += more;
  };
  add(toString(binding.first));
  add(toString(binding.second));
  add(binding.mouse);
  return text;
}

std::string bindingsInMarkdown() {
  std::string text = "| input | does | while held |\n|---|---|---|\n";
  const char* group = "";
  for (const Binding& binding : kBindings) {
    if (std::string(group) != binding.group) {
      group = binding.group;
      text += "| **";
      text += group;
      text += "** | | |\n";
    }
    text += "| ";
    const bool keys = binding.first.code != Key::kNone;
    if (keys) text += "`";
    text += inputsOf(binding);
    if (keys) text += "`";
    text += " | ";
    text += binding.what;
    text += " | ";
    text += toString(binding.held);
    text += binding.held == Held::once ? "|\n" : " |\n";
  }
  return text;
}

}  // namespace filiform
