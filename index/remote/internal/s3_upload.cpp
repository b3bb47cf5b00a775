#include "index/remote/internal/s3_upload.h"

#include "index/remote/internal/http_errors.h"
#include "index/remote/internal/s3_answer.h"
#include "index/remote/internal/s3_listing.h"
#include "index/text.h"
#include "index/workers.h"

#include <algorithm>
#include <atomic>
#include <string_view>

namespace filiform::internal {
namespace {

constexpr int kMostPartPages = 100;

}  // namespace

std::uint64_t S3Upload::partBytes(std::uint64_t file_bytes) {
  return std::max(kPart, (file_bytes + kMostParts - 1) / kMostParts);
}

S3Upload::Begun S3Upload::resume(const std::string& name, std::uint64_t bytes) {
  const std::string url = address_.files + name;
  const std::uint64_t part = partBytes(bytes);
  Begun upload;
  try {
    for (const S3Object& begun : listUploads(client_, address_, name))
      if (begun.name == name) upload.id = begun.upload;
    if (upload.id.empty()) return {};
    upload.tags.resize((bytes + part - 1) / part);
    std::string marker = "0";
    for (int page = 0; page < kMostPartPages && !marker.empty(); ++page) {
      const std::string listed =
          readList(client_, url + "?max-parts=1000&part-number-marker=" + marker + "&uploadId=" + queryText(upload.id));
      forEachElement(listed, "Part", [&](std::string_view one) {
        const std::uint64_t number = numberOrZero(xmlText(one, "PartNumber"));
        if (number < 1 || number > upload.tags.size()) return;
        const std::uint64_t begin = (number - 1) * part;
        if (numberOrZero(xmlText(one, "Size")) == std::min(part, bytes - begin))
          upload.tags[number - 1] = unquoted(xmlText(one, "ETag"));
      });
      const std::string next = xmlText(listed, "NextPartNumberMarker");
      marker = xmlText(listed, "IsTruncated") == "true" && numberOrZero(next) > numberOrZero(marker) ? next : "";
    }
    return upload;
  } catch (const DeniedByServer&) {  // keys that may write, but not list
    return {};
  } catch (const NotOnServer&) {  // it ended meanwhile
    return {};
  }
}

S3Upload::Begun S3Upload::begin(const std::string& name, std::uint64_t bytes, const std::string& digest) {
  Begun upload = resume(name, bytes);
  if (!upload.id.empty()) return upload;
  const std::string url = address_.files + name;
  const HttpClient::Reply reply =
      client_.send({.method = "POST", .url = url + "?uploads=", .headers = {"x-amz-meta-xxh3: " + digest}});
  upload.id = xmlText(reply.body, "UploadId");
  if (upload.id.empty())
    throw IoError(inShort(url), "the store gives no number for an upload in parts; check the endpoint");
  const std::uint64_t part = partBytes(bytes);
  upload.tags.assign((bytes + part - 1) / part, "");
  return upload;
}

void S3Upload::finish(const std::string& name, std::uint64_t bytes, const Begun& upload) {
  std::string list = "<CompleteMultipartUpload>";
  for (std::size_t i = 0; i < upload.tags.size(); ++i)
    list += "<Part><PartNumber>" + std::to_string(i + 1) + "</PartNumber><ETag>&quot;" + upload.tags[i] +
            "&quot;</ETag></Part>";
  list += "</CompleteMultipartUpload>";
  const std::string url = address_.files + name;
  const auto body = std::span(reinterpret_cast<const std::uint8_t*>(list.data()), list.size());
  std::string code;
  for (int attempt = 0; attempt < 3; ++attempt) {
    try {
      const HttpClient::Reply reply =
          client_.send({.method = "POST", .url = url + "?uploadId=" + queryText(upload.id), .body = body});
      code = xmlText(reply.body, "Code");  // a store may find an error after it has answered 200
      if (code.empty()) return;
    } catch (const NotOnServer&) {  // finished before, and the answer was lost
      if (client_.facts(url).bytes == bytes) return;
      throw;
    }
  }
  throw IoError(inShort(url), "the store does not finish the upload (" + escaped(code, 64) + "); push again");
}

void S3Upload::send(const std::string& name, std::uint64_t bytes, const std::string& digest, const Read& read,
                    const Progress& progress) {
  const std::string url = address_.files + name;
  if (bytes < kOnePart) {
    Bytes all(bytes);
    read(0, all);
    client_.send({.method = "PUT", .url = url, .body = all, .headers = {"x-amz-meta-xxh3: " + digest}});
    progress(bytes);
    return;
  }
  Begun upload = begin(name, bytes, digest);
  const std::uint64_t part = partBytes(bytes);
  const auto sizeOf = [&](std::size_t i) { return std::min(part, bytes - i * part); };
  std::vector<std::size_t> missing;
  std::atomic<std::uint64_t> done{0};
  for (std::size_t i = 0; i < upload.tags.size(); ++i) {
    if (upload.tags[i].empty())
      missing.push_back(i);
    else
      done += sizeOf(i);
  }
  progress(done);
  std::atomic<std::size_t> next{0};
  runWorkers(std::min<std::size_t>(kAtOnce, missing.size()), [&](std::size_t worker, const std::atomic<bool>& failed) {
    Bytes piece;
    for (std::size_t m = next++; m < missing.size() && !failed; m = next++) {
      const std::size_t i = missing[m];
      piece.resize(sizeOf(i));
      read(i * part, piece);
      const std::string query = "?partNumber=" + std::to_string(i + 1) + "&uploadId=" + queryText(upload.id);
      upload.tags[i] = unquoted(client_.send({.method = "PUT", .url = url + query, .body = piece}).tag);
      done += piece.size();
      if (worker == 0) progress(done);
    }
  });
  progress(bytes);
  finish(name, bytes, upload);
}

}  // namespace filiform::internal
