// Something to draw with: an OpenGL 3.3 core context, without a window.
#pragma once

#include "index/errors.h"

#include <memory>
#include <string>

namespace filiform {

// There is no OpenGL 3.3 here, or it failed. The text says what to do. Exit code 3.
class GraphicsError : public Error {
 public:
  using Error::Error;
};

// Thread rule: belongs to one thread at a time, that which called makeCurrent() last.
class GraphicsContext {
 public:
  virtual ~GraphicsContext() = default;
  // Throws GraphicsError.
  virtual void makeCurrent() = 0;
  // Who draws, in words of the driver: "llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5".
  virtual std::string description() const = 0;
};

// Of the context that is current, whoever made it.
std::string describeCurrentContext();
// Draws the processor itself? Then a picture of a million segments takes a second.
bool isSoftwareRenderer(const std::string& description);

// Through EGL, without a display: Mesa's surfaceless platform where it is, else the first graphics card that EGL lists.
// It is current when this returns. Throws GraphicsError.
std::unique_ptr<GraphicsContext> makeOffscreenContext();

}  // namespace filiform
