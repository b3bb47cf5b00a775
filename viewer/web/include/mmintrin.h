// Eigen includes this for SSE2; WebAssembly has no MMX.
