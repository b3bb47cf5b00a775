// Proxies: which client a request comes from, also behind proxies that the operator states.
//
//   const Proxies proxies({"10.0.0.0/8"});
//   proxies.clientOf("10.0.0.2", "198.51.100.7, 10.0.0.9");    // 198.51.100.7
//
// Thread rule: immutable.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::tools {

struct Person;

class Proxies {
 public:
  // ADDRESS or ADDRESS/BITS each. Throws UsageError.
  explicit Proxies(const std::vector<std::string>& networks = {});

  // True if the address is a stated proxy's.
  bool has(std::string_view address) const;
  // The client's address: the last one of X-Forwarded-For that is no stated proxy's, if `peer` is a stated proxy.
  // Otherwise `peer`: anybody can send that header. O(length of the header times networks).
  std::string clientOf(const std::string& peer, std::string_view forwarded_for) const;

 private:
  struct Network {
    std::array<std::uint8_t, 16> address;
    unsigned bits;
  };
  std::vector<Network> networks_;
};

// The name under which the shares of a client are counted: its address; of IPv6 the network of 64 bits.
std::string shareOf(const std::string& address);
// The name under which work is counted: the person's own, if a token or a proxy names them, else the client's.
std::string workShareOf(const std::string& address, const Person* person);

}  // namespace filiform::tools
