// The answer to a request that cannot be read. Included by server.cpp alone, because it needs Boost.Beast. Functions
// without state.
#pragma once

#include <boost/beast/http/error.hpp>

namespace filiform::tools::internal {

// The status for a request that cannot be read; 0: the connection is gone, also after a timeout.
inline unsigned statusOf(const boost::system::error_code& error) {
  namespace http = boost::beast::http;
  if (error == http::error::header_limit) return 431;
  if (error == http::error::body_limit) return 413;
  if (error == http::error::end_of_stream || error == http::error::partial_message) return 0;
  if (error == http::error::bad_version) return 505;
  return error.category() == http::make_error_code(http::error::bad_method).category() ? 400 : 0;
}

inline const char* detailOf(unsigned status) {
  switch (status) {
    case 431:
      return "the header is longer than 16 KiB";
    case 413:
      return "the body is longer than 8 MiB; send it in parts";
    case 505:
      return "use HTTP/1.1";
    default:
      return "this is no HTTP request";
  }
}

}  // namespace filiform::tools::internal
