// FLANN's headers call these functions of LZ4 when a search tree is stored. filiform stores no search tree, so a call
// ends the program.
#include <cstdlib>

extern "C" {

int LZ4_compress_HC_continue(void*, const char*, char*, int, int) { std::abort(); }
int LZ4_decompress_safe(const char*, char*, int, int) { std::abort(); }
int LZ4_decompress_safe_continue(void*, const char*, char*, int, int) { std::abort(); }
void LZ4_resetStreamHC(void*, int) { std::abort(); }
int LZ4_setStreamDecode(void*, const char*, int) { std::abort(); }
}
