"""An object store of this machine: moto's S3 behind a server that counts and can lose objects."""

import threading
from contextlib import contextmanager
from dataclasses import dataclass, field

import pytest
import s3fs
from moto.server import DomainDispatcherApplication, create_backend_app
from werkzeug.serving import WSGIRequestHandler, make_server

LOST = b"<Error><Code>ServiceUnavailable</Code></Error>"


class Silent(WSGIRequestHandler):
    "Leaves the log of each request out"

    def log_request(self, *arguments):
        pass


@dataclass
class ObjectStore:
    """S3 at an address; what was asked of it.

    ``requests`` are (method, path, range, bytes). Of the object that ends as ``lost`` it answers
    only ``lost_after`` more reads.
    """

    url: str = ""
    requests: list = field(default_factory=list)
    lost: str = ""
    lost_after: int = 0
    app: object = field(
        default_factory=lambda: DomainDispatcherApplication(create_backend_app), repr=False
    )

    def __call__(self, environ, start_response):
        "A request, as WSGI has it"
        method = environ["REQUEST_METHOD"]
        path = environ["PATH_INFO"]
        if self.lost and path.endswith(self.lost) and method in ("GET", "PUT"):
            self.lost_after -= 1
            if self.lost_after < 0:
                start_response("503 Service Unavailable", [("Content-Length", str(len(LOST)))])
                return [LOST]

        def begin(status, headers, *rest):
            if method == "GET":
                size = int(dict(headers).get("Content-Length", 0))
            else:
                size = 0
            self.requests.append((method, path, environ.get("HTTP_RANGE"), size))
            return start_response(status, headers, *rest)

        return self.app(environ, begin)

    def read(self, end):
        "Bytes that were read of objects that end so, and the number of requests"
        sizes = [
            n for method, path, _, n in self.requests if method == "GET" and path.endswith(end)
        ]
        return sum(sizes), len(sizes)


@contextmanager
def object_store(bucket):
    "An ObjectStore with an empty bucket, named in the environment, and its s3fs file system"
    store = ObjectStore()
    server = make_server("127.0.0.1", 0, store, threaded=True, request_handler=Silent)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    store.url = f"http://127.0.0.1:{server.server_port}"
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {
            "AWS_ENDPOINT_URL": store.url,
            "AWS_ACCESS_KEY_ID": "key",
            "AWS_SECRET_ACCESS_KEY": "secret",
            "AWS_DEFAULT_REGION": "us-east-1",
            "AWS_EC2_METADATA_DISABLED": "true",
            "AWS_MAX_ATTEMPTS": "1",
            "AWS_CONFIG_FILE": "none",
            "AWS_SHARED_CREDENTIALS_FILE": "none",
        }.items():
            patch.setenv(name, value)
        s3fs.S3FileSystem.clear_instance_cache()
        files = s3fs.S3FileSystem()
        files.mkdir(bucket)
        try:
            yield store, files
        finally:
            files.rm(bucket, recursive=True)
            s3fs.S3FileSystem.clear_instance_cache()
            server.shutdown()
            thread.join()
            server.server_close()
