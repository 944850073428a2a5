# The S3 gateway of docker-compose.yml: objects are files in a volume. No root.
FROM golang:1.26-bookworm AS build
RUN CGO_ENABLED=0 go install github.com/versity/versitygw/cmd/versitygw@v1.8.0

FROM python:3.11-slim
COPY --from=build /go/bin/versitygw /usr/local/bin/versitygw
# A folder under the root is a bucket.
RUN useradd --uid 10001 --create-home farfield && install -d -o farfield -g farfield /data /data/farfield
USER farfield
VOLUME /data/farfield
EXPOSE 7070
HEALTHCHECK --interval=5s --timeout=3s --start-period=5s CMD ["python", "-c", \
    "import urllib.request as u; u.urlopen('http://127.0.0.1:7070/health', timeout=2)"]
CMD ["versitygw", "--port", ":7070", "--health", "/health", "posix", "/data"]
