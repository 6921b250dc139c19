# rom with FEniCSx on Debian 12.
#
#   docker build -t rom .
#   docker run --rm -v "$PWD":/work rom mesh part.step
FROM debian:bookworm-slim

RUN apt-get update -qq \
    && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
        python3-dolfinx python3-petsc4py python3-slepc4py python3-gmsh python3-meshio \
        python3-scipy python3-numba python3-h5py python3-venv python3-dev libopenblas0-pthread \
        gcc g++ pkg-config libgl1 libegl1 libxrender1 \
    && rm -rf /var/lib/apt/lists/*

COPY pyproject.toml setup.py constraints.txt README.md LICENSE /opt/rom/
COPY rom /opt/rom/rom
COPY demos /opt/rom/demos
COPY meshes /opt/rom/meshes
RUN cd /opt/rom \
    && /usr/bin/python3 -m venv --system-site-packages .venv \
    && .venv/bin/pip install -q --no-cache-dir -c constraints.txt '.[view]'

# on another machine than this one, `doctor` says whether OPENBLAS_CORETYPE makes it faster;
# compiled forms and kernels are kept in the home of the user who runs the container
RUN useradd --create-home --uid 1000 rom && mkdir /work && chown rom /work
USER rom
WORKDIR /work
ENTRYPOINT ["/opt/rom/.venv/bin/rom"]
CMD ["doctor"]
