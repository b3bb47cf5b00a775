#include "index/file/signature.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

// RFC 4231, cases 1, 2 and 6.
TEST(Signature, IsThatOfTheStandard) {
  EXPECT_EQ(signatureOf("Hi There", std::string(20, '\x0b')),
            "b0344c61d8db38535ca8afceaf0bf12b881dc200c9833da726e9376c2e32cff7");
  EXPECT_EQ(signatureOf("what do ya want for nothing?", "Jefe"),
            "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843");
  EXPECT_EQ(signatureOf("Test Using Larger Than Block-Size Key - Hash Key First", std::string(131, '\xaa')),
            "60e431591ee0b67f0d8a26aacbf5b77f8e0bc6213728c5140546040f0ee37f54");
}

// FIPS 180-2, B.1.
TEST(Signature, WithoutAKeyIsTheDigest) {
  EXPECT_EQ(sha256Digits("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

}  // namespace
}  // namespace filiform
