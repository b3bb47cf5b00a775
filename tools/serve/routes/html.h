// Text in the pages of the service. Functions without state.
#pragma once

#include <string>

namespace filiform::tools {

// Text of a page or of an attribute in double quotes. Control characters become blanks.
std::string htmlText(const std::string& text);
// A name as a part of a URL's path.
std::string urlPart(const std::string& name);

}  // namespace filiform::tools
