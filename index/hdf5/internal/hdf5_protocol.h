// The protocol between filiform and the program `filiform-hdf5`, which reads HDF5 files in a process of its own: a
// damaged file may crash or hang the HDF5 library. The program reads requests from its standard input and writes
// records to its standard output. All numbers are little-endian.
//
//   request   number of texts u32 (at most kMostTexts); each: bytes u32 (at most kMostTextBytes), the text
//   record    kind u32, bytes of the payload u32 (at most kMostPayload), XXH3-64 of the payload with the kind as seed
//   u64,
//             the payload
//
// Each request is answered by some records and one record `end`, or by one record `failure`, whose payload says why.
// While the program searches long in a large file, empty records of names say that it has not stopped.
// The texts of a request are its name and its arguments:
//   morphologies FILE     names: the morphologies of a container, ascending. One empty name: a file of one morphology
//   morphology FILE NAME  points: x y z diameter f64 each. Then structure: first point, type, parent section i64 each
//   populations FILE      names: the node populations, ascending
//   population FILE NAME  for each attribute: column, then its values in one or more records
// A payload of names: each bytes u32, text. A column: group i64 (-1: of the population itself), type u32, values in a
// row u32, rows u64, the name. Values: f64 or i64 each; texts: bytes u32, text. `skipped` names an attribute that is
// not read, and why: the name, then the reason, each as a name.
//
// To write a file, three kinds of request, each answered by `end` or `failure`:
//   create FILE                    replaces the file
//   write PATH TYPE WIDTH ROWS     an array of ROWS values, or ROWS x WIDTH if WIDTH is not 1; TYPE is one of f64 f32
//   i64
//                                  i32 u32 i8 text. Blocks follow: bytes u32 (at most kMostPayload), then values as in
//                                  a record; a block of 0 bytes is the last. Groups on the way are created
//   finish                         closes the file
// The same requests give the same bytes.
//
// Thread rule: constants.
#pragma once

#include <cstdint>

namespace filiform::hdf5 {

enum class RecordKind : std::uint32_t { end, failure, names, points, structure, column, values, skipped };
enum class ColumnType : std::uint32_t { real, integer, text };

inline constexpr std::uint32_t kMostTexts = 8;
inline constexpr std::uint32_t kMostTextBytes = 1u << 16;
inline constexpr std::uint32_t kMostPayload = 1u << 24;

}  // namespace filiform::hdf5
