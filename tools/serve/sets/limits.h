// The limits of the service. tools/serve/README.md lists them. Constants.
#pragma once

#include <cstddef>
#include <cstdint>

namespace filiform::tools::limits {

inline constexpr std::size_t kTargetBytes = 8 << 10;                 // path and query of a request
inline constexpr std::size_t kHeaderBytes = 16 << 10;                // of a request
inline constexpr std::size_t kBodyBytes = 8 << 20;                   // of a request
inline constexpr std::size_t kAnswerBytes = std::size_t{256} << 20;  // of an answer made in memory
inline constexpr std::size_t kPoints = 100'000;                      // of a request
inline constexpr std::size_t kNeighbours = 10'000;                   // k
inline constexpr std::size_t kRows = 1'000'000;                      // of an answer: points times k
inline constexpr std::size_t kListedCells = 1000;                    // of a page of cells
inline constexpr std::uint32_t kScannedCells = 65'536;               // for a page of cells
inline constexpr std::uint64_t kBoxSegments = 2'000'000;             // in the tiles that a box meets
inline constexpr std::uint64_t kCellSamples = 1'000'000;   // of a cell that is sent, or on which a path is sought
inline constexpr std::size_t kMeasuredValues = 1'000'000;  // of an answer: rows times columns
inline constexpr std::size_t kContactSites = 100'000;      // of an answer
inline constexpr std::uint32_t kDoorCells = 2'000'000;     // listed for Neuroglancer in one answer
inline constexpr std::size_t kDoorNodes = 1'000'000;       // of a box for CATMAID's clients
inline constexpr double kQuery_s = 5;                      // for an answer

}  // namespace filiform::tools::limits
