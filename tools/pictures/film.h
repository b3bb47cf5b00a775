// A film, written picture by picture: numbered PNG files, or one file made by ffmpeg. Each file is written through
// Output (index/output.h). Thread rule: thread-compatible.
#pragma once

#include "viewer/gl/renderer.h"

#include <memory>
#include <string>
#include <vector>

namespace filiform::tools {

// Returns whether this is the name of a film: a sequence (with one %d or %05d), or .mp4, .mkv, .webm or .mov.
bool isFilmName(const std::string& name);
// Returns whether this is the name of a sequence.
bool isSequenceName(const std::string& name);
// The existing files that a sequence of this name would replace. Empty for other names.
std::vector<std::string> filesOfSequence(const std::string& name);

class Film {
 public:
  // A file needs ffmpeg in PATH. Without ffmpeg the pictures become a sequence beside the file, OUT-%05d.png for
  // OUT.mp4, and note() says so. Throws UsageError for another name, for a file smaller than 2 x 2 pixels, and for a
  // rate that is not above 0 and finite.
  Film(const std::string& out, int width, int height, double pictures_s);
  // Removes an unfinished file. The pictures of a sequence stay.
  ~Film();
  Film(const Film&) = delete;
  Film& operator=(const Film&) = delete;

  // Requires the size given to the constructor. Throws IoError, with ffmpeg's message if ffmpeg failed.
  void add(const Picture& picture);
  // Publishes the file. Throws IoError, ClosedPipe.
  void finish();

  const std::string& out() const noexcept;  // what is written: the file, or the pattern of the sequence
  const std::string& note() const noexcept;
  std::uint64_t pictures() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::tools
