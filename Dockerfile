# Any Debian-based image with Python 3.11 and its venv module; both stages must use the same one. A digest pins it:
# --build-arg BASE_IMAGE=python:3.11-slim@sha256:...
ARG BASE_IMAGE=python:3.11-slim

FROM ${BASE_IMAGE} AS builder
# A folder of wheels in place of the package index, for builds without a network (.ci/container).
ARG PIP_NO_INDEX
ARG PIP_FIND_LINKS
RUN python3 -m venv /opt/planner
ENV PATH=/opt/planner/bin:$PATH PIP_NO_CACHE_DIR=1 PIP_NO_COMPILE=1 PIP_DISABLE_PIP_VERSION_CHECK=1
WORKDIR /source

# The dependencies change seldom: a layer of their own is built once. Each file that pip installs has a known hash.
COPY locks locks
# Further packages by the names of their extras, with commas between them: robots, postgresql, cluster, otel.
ARG EXTRAS=""
RUN for list in service $(echo "$EXTRAS" | tr , " "); do echo "--requirement locks/$list.txt"; done \
        | xargs pip install --require-hashes

COPY LICENSE README.md pyproject.toml ./
COPY planner planner
COPY api api
COPY cli cli
COPY examples examples
COPY web web
RUN python3 -m venv /opt/build \
    && /opt/build/bin/pip install --require-hashes --requirement locks/build.txt \
    && /opt/build/bin/pip wheel --no-build-isolation --no-deps --wheel-dir /opt/build . \
    && pip install --no-deps --no-index /opt/build/*.whl

# What only serves to compile or to test against the packages goes. Wheels hold up to three copies of a library where a
# system has links: one copy is kept. Byte code is made here, since the service cannot write it on a read-only file
# system, and by unchecked hash, so that it holds whatever time stamps the copy into the final stage gives the sources.
RUN pip uninstall --yes pip setuptools \
    && cd /opt/planner && rm -rf include share lib/python3*/site-packages/cmeel.prefix/share \
    && cd lib/python3*/site-packages && rm -rf include casadi/include cmeel.prefix/include numpy/_core/include \
    && find numpy scipy matplotlib -depth -type d -name tests -exec rm -rf {} + \
    && find . -depth -type d \( -name cmake -o -name pkgconfig \) -exec rm -rf {} + \
    && find /opt/planner -type f \( -name '*.a' -o -name '*.h' -o -name '*.hpp' -o -name '*.pxd' \) -delete \
    && hardlink --content --include '\.so' . \
    && python -m compileall -q -j 0 --invalidation-mode unchecked-hash .

FROM ${BASE_IMAGE}
# Pinocchio is linked to the system's OpenMP runtime. The base's own headers go too.
RUN apt-get update \
    && apt-get install --yes --no-install-recommends libgomp1 \
    && rm -rf /var/lib/apt/lists/* /var/cache/apt/* \
    && find /usr -xdev -type f \( -name '*.h' -o -name '*.a' \) -delete \
    && useradd --uid 10001 --no-create-home --home-dir /nonexistent --shell /usr/sbin/nologin planner \
    && install -d -o 10001 -g 10001 /data
COPY --from=builder /opt/planner /opt/planner
# /dev/shm is the one place that stays writable on a read-only root file system.
ENV PATH=/opt/planner/bin:$PATH \
    PYTHONDONTWRITEBYTECODE=1 PYTHONUNBUFFERED=1 \
    TMPDIR=/dev/shm MPLCONFIGDIR=/dev/shm/matplotlib \
    PLANNER_HOST=0.0.0.0 PLANNER_PORT=8000
USER 10001:10001
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=5s --start-period=30s \
    CMD ["python", "-c", "import os, urllib.request as r; r.urlopen(f'http://127.0.0.1:{os.environ[\"PLANNER_PORT\"]}/livez', timeout=4)"]
CMD ["planner", "serve"]
