# The page and all commands: docker build -t odscen . && docker compose up. See docs/container.md.
FROM python:3.12-slim AS build
WORKDIR /build
COPY . .
# Node comes as a Python package; the page is built into the wheel.
RUN python -m pip wheel --no-cache-dir --no-deps --wheel-dir wheels .

FROM python:3.12-slim
# With this allocator SUMO is a tenth faster; its version is that of the base image.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends libtcmalloc-minimal4 \
    && rm -rf /var/lib/apt/lists/*
# In one step, or the layer of pip would keep what is removed.
RUN --mount=type=bind,from=build,source=/build,target=/build \
    python -m pip install --no-cache-dir /build/wheels/*.whl \
    && sh /build/tools/slim_sumo.sh
RUN useradd --create-home --uid 10001 odscen \
    && install --directory --owner=odscen /workspace
USER 10001
ENV ODSCEN_WORKSPACE=/workspace
VOLUME /workspace
EXPOSE 8420
# Without its token the page answers 401, which shows that it is there.
HEALTHCHECK --interval=30s --timeout=5s --start-period=30s \
    CMD ["python", "-c", "import http.client as c; h = c.HTTPConnection('127.0.0.1', 8420, timeout=4); h.request('GET', '/'); raise SystemExit(h.getresponse().status != 401)"]
ENTRYPOINT ["odscen"]
CMD ["serve", "--host", "0.0.0.0", "--no-browser"]
