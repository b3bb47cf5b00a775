// An OpenGL 3.3 core context; makeOffscreenContext() makes one without a window.
#pragma once

#include "index/errors.h"

#include <memory>
#include <string>

namespace filiform {

// OpenGL 3.3 is missing or failed. The text says what to do. Exit code 3.
class GraphicsError : public Error {
 public:
  using Error::Error;
};

// Thread rule: belongs to one thread at a time, the last one that called makeCurrent().
class GraphicsContext {
 public:
  virtual ~GraphicsContext() = default;
  // Throws GraphicsError.
  virtual void makeCurrent() = 0;
  // The driver's names of renderer and version: "llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5".
  virtual std::string description() const = 0;
};

// What OpenGL reported as errors.
struct GraphicsErrors {
  std::string text;  // of the first one; empty: none
  bool out_of_memory = false;
};
// Collects the errors of the current context from now on, with the driver's words if it has KHR_debug.
void watchGraphicsErrors();
// The errors since the last call. Asks the driver: a round trip.
GraphicsErrors takeGraphicsErrors();

// The description of the current context.
std::string describeCurrentContext();
// True for a renderer that runs on the processor: a picture of a million segments then takes seconds.
bool isSoftwareRenderer(const std::string& description);

// Makes a context by EGL, without a display, and makes it current. `gpu`: the number of a graphics card in EGL's list,
// from 0; "software": draw with the processor; empty: the first card that can, else the processor. Throws UsageError
// for another text, GraphicsError.
std::unique_ptr<GraphicsContext> makeOffscreenContext(const std::string& gpu = "");

}  // namespace filiform
