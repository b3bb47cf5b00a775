// A film, picture by picture: numbered PNG files, or one file that ffmpeg makes. Each goes through Output
// (index/output.h). Thread rule: thread-compatible.
#pragma once

#include "tools/drawing/image.h"

#include <memory>
#include <string>
#include <vector>

namespace filiform::tools {

// Is it the name of a film: a sequence with one %d or %05d in it, or .mp4, .mkv, .webm, .mov?
bool isFilmName(const std::string& name);
// Of a sequence?
bool isSequenceName(const std::string& name);
// The files that are there now and that a sequence of this name would replace. Empty for other names.
std::vector<std::string> filesOfSequence(const std::string& name);

class Film {
 public:
  // For a file ffmpeg must be on the path; where it is not, the pictures become a sequence beside it, OUT-%05d.png
  // instead of OUT.mp4, and note() says so. Throws UsageError for another name, a size below 2 x 2 for a file, or a
  // rate that is not > 0 and finite.
  Film(const std::string& out, int width, int height, double pictures_s);
  // Removes a file that was not finished; a sequence stays as far as it came.
  ~Film();
  Film(const Film&) = delete;
  Film& operator=(const Film&) = delete;

  // Requires the size that was given. Throws IoError, with ffmpeg's reason where it gave up.
  void add(const Image& image);
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
