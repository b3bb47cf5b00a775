#include "index/stores/internal/stored_set.h"

#include "index/errors.h"
#include "index/file/internal/bytes.h"
#include "index/file/internal/set_files.h"
#include "index/remote/internal/http_errors.h"
#include "index/set/internal/manifest.h"
#include "index/text.h"

namespace filiform::internal {

std::string currentAt(HttpClient& client, const RemoteAddress& address) {
  const std::string url = address.files + kCurrentFile;
  try {
    const Bytes text = client.readWhole(url, kMostCurrentBytes);
    std::string name(text.begin(), text.end());
    if (!name.empty() && name.back() == '\n') name.pop_back();
    if (!isRevisionName(name))
      throw InputError(inShort(url) + ": is there and names no revision of a tile set; choose another address");
    return name;
  } catch (const NotOnServer&) {
    return {};
  } catch (const DeniedByServer&) {
    return {};
  }
}

}  // namespace filiform::internal
