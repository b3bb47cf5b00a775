#include <filiform/viewer/gl/graphics_context.h>
#include <filiform/viewer/scene/camera.h>

#include <iostream>

int main() {
  const filiform::Camera camera = filiform::overview({0, 0, 0}, {100, 100, 100}, 0, 0, 1.6);
  std::cout << "looks at " << camera.focus_W().transpose() << '\n';
  try {
    std::cout << filiform::makeOffscreenContext()->description() << '\n';
  } catch (const filiform::GraphicsError& error) {
    std::cout << error.what() << '\n';
  }
}
