// Reads Neurolucida ASC files: nested lists of points `(x y z diameter)`.
//
//   ("CellBody" (Color Red) (CellBody) (0 5 0 0) (5 0 0 0) (0 -5 0 0))     ; a contour of the soma
//   ((Color Cyan) (Axon)                                                   ; or Dendrite, Apical
//     (0 6 0 1.4) (0 9 0 1.2)
//     ((1 12 0 1) (2 15 0 1) | (-1 12 0 1) Normal))                        ; two branches
//
// Diameters become radii. Axon is type 2, Dendrite 3, Apical 4; a tree without one of these is type 0 (W_BAD_TYPE).
// Letter case does not matter. A branch that begins with the last point of its parent shares this point, and so does a
// tree that begins at a point of another tree (REPEATED_POINT, tree_joins.h). Contours of a soma, by type or by the
// name "Soma", become one sphere (SOMA_CONTOUR, soma_link.h); contours that follow each other and overlap are one soma.
// Spines, markers, texts and other contours are left out (W_ELEMENT); a list without a type is one of these if it has a
// text or no diameter. Ids count the points of trees and somata from 1, in file order; a soma has
// the id of its first point. Nesting has no limit but memory. An unclosed parenthesis: E_FORMAT.
#pragma once

namespace filiform {

namespace internal {
class ByteStream;
class GraphBuilder;
}  // namespace internal

// Reads the whole input into `graph`. graph_file.h states the errors.
void readNeurolucida(internal::ByteStream& in, bool soma_links, internal::GraphBuilder& graph);

}  // namespace filiform
