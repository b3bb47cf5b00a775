#include "tools/commands/figure/figure_arguments.h"

#include "index/errors.h"
#include "index/text.h"
#include "tools/pictures/camera_text.h"
#include "tools/words/numbers.h"

#include <cmath>

#include <CLI/CLI.hpp>

namespace filiform::tools {

void FigureArguments::check(int most) const {
  if (!background.empty() && background != "white" && background != "dark" && background != "none")
    throw UsageError("--background " + inShort(background) + ": choose white, dark or none");
  if (!size_mm.empty()) size("", most);
}

Theme FigureArguments::on(Theme theme) const {
  return background.empty() ? theme : background == "dark" ? Theme::dark : Theme::light;
}

Rgba FigureArguments::ground(Theme theme) const {
  if (background.empty()) return groundOf(theme);
  return background == "dark" ? kDarkGround : Rgba{255, 255, 255};
}

PictureSize FigureArguments::size(const std::string& size, int most) const {
  if (size_mm.empty()) return parseSize("--size", size, most);
  const std::size_t cross = size_mm.find('x');
  if (cross == std::string::npos || size_mm.find('x', cross + 1) != std::string::npos)
    throw UsageError("--size-mm " + inShort(size_mm) + ": give WIDTHxHEIGHT in mm, such as 85x60");
  const double width_mm = parseNumber("--size-mm", size_mm.substr(0, cross)),
               height_mm = parseNumber("--size-mm", size_mm.substr(cross + 1));
  const double width = std::round(width_mm / 25.4 * dpi), height = std::round(height_mm / 25.4 * dpi);
  if (!(width >= 1 && height >= 1 && width <= most && height <= most))
    throw UsageError("--size-mm " + inShort(size_mm) + " with " + formatNumber(dpi) + " pixels an inch is " +
                     formatNumber(width) + " x " + formatNumber(height) + " pixels; a side has 1 to " +
                     std::to_string(most));
  return {static_cast<int>(width), static_cast<int>(height)};
}

void addFigureArguments(CLI::App& command, FigureArguments& arguments) {
  command
      .add_option("--background", arguments.background,
                  "draw on this ground instead of the theme's, without fog and shading by depth; none: PNG is "
                  "transparent, SVG and PDF have no ground")
      ->type_name("white|dark|none");
  command.add_flag("--scale-bar", arguments.scale_bar,
                   "add a scale bar; its length is correct at the depth of the view's middle");
  command.add_flag("--legend", arguments.legend,
                   "add the legend of --colour-by type; an attribute or a measure always has its legend");
  command.add_flag("--orientation", arguments.orientation, "add arrows along x, y and z");
  command.add_option("--title", arguments.title, "write this above the picture")->type_name("TEXT");
  CLI::Option* size = command.add_option("--size-mm", arguments.size_mm, "size on paper, mm, instead of --size")
                          ->type_name("WxH")
                          ->excludes(command.get_option("--size"));
  command.add_option("--dpi", arguments.dpi, "pixels an inch, for --size-mm")
      ->capture_default_str()
      ->needs(size)
      ->check(CLI::Range(10.0, 2400.0));
}

}  // namespace filiform::tools
