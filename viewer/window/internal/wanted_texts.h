// The texts that the panels may show next: names of cells and files have letters of any script. Thread rule: that of
// the window.
#pragma once

#include "viewer/window/panels/panels.h"

namespace filiform {

class Window;

namespace internal {

class OpenScene;
class WindowActions;

// Tells the window of all of them, so that its font has their letters. O(texts).
void wantTexts(Window& window, const PanelData& data, const OpenScene& scene, const WindowActions& actions);

}  // namespace internal
}  // namespace filiform
