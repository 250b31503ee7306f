// Sweeps of one level on a GPU, compiled at run time with -DREAL=float or double (the precision of the state) and
// -DLAW=0 (no adhesion) or 1 (exponential adhesion). The formulas are those of rows.rs, residuals.rs and column.rs.
//
// A field has ny rows of nx nodes. `work` is the array that is transformed in place: rows of `pitch` = 2 (nx/2 + 1) real
// elements, or of nx/2 + 1 complex ones. Kernels that sum write one value per block and sum to `out`; the grid of
// blocks does not depend on the card, so neither does the order of the sums.

#define PASTE(a, b) a##b
#define COMPLEX(real) PASTE(real, 2)
typedef unsigned short bf16;
typedef long long index;

// Mark of closed nodes in a direction: negative zero.
#define CLOSED 0x8000

#define THREADS 256

// From this many ranges on the attraction is zero.
#define FAR 40

#define NODES \
    for (int y = blockIdx.y; y < ny; y += gridDim.y) \
        for (int x = blockIdx.x * THREADS + threadIdx.x; x < nx; x += gridDim.x * THREADS)

__device__ inline bf16 rounded_direction(float d) {
    unsigned bits = __float_as_uint(d);
    bf16 rounded = (bits + 0x7fff + (bits >> 16 & 1)) >> 16;
    return rounded == CLOSED ? 0 : rounded;
}

__device__ inline float wide(bf16 d) { return __uint_as_float((unsigned)d << 16); }

__device__ inline REAL moved(REAL gap, REAL scale, float step) {
    REAL to = gap + scale * (REAL)step;
    return to > 0 ? to : 0;
}

__device__ inline bool is_free(REAL gap, float t) { return gap > 0 || t < 0; }

// exp(-g/rho), zero far away.
__device__ inline REAL boltzmann(REAL gap, REAL rho) {
    REAL x = gap / rho;
    return x >= FAR ? 0 : exp(-x);
}

// v'' d.
__device__ inline REAL force(REAL gap, REAL d, REAL gamma, REAL rho) {
    return LAW && d != 0 ? -gamma / (rho * rho) * boltzmann(gap, rho) * d : 0;
}

// Sums of a block in a fixed order.
template <int K> __device__ void reduce(double *sums, double *out) {
    __shared__ double shared[THREADS / 32][K];
    int lane = threadIdx.x % 32, warp = threadIdx.x / 32;
    for (int k = 0; k < K; k++) {
        for (int distance = 16; distance > 0; distance /= 2)
            sums[k] += __shfl_down_sync(0xffffffff, sums[k], distance);
        if (lane == 0) shared[warp][k] = sums[k];
    }
    __syncthreads();
    if (threadIdx.x < K) {
        double sum = 0;
        for (int w = 0; w < THREADS / 32; w++) sum += shared[w][threadIdx.x];
        out[((index)blockIdx.y * gridDim.x + blockIdx.x) * K + threadIdx.x] = sum;
    }
}

// Adds residual², residual, |t g|, g, v(g) and closed nodes of a node to the sums, with `t` the elastic stress plus
// pressure, to which the traction of the law is added. Returns the residual of the optimality conditions.
__device__ inline REAL add_state(double *sums, REAL g, REAL &t, REAL gamma, REAL rho) {
    if (LAW) {
        REAL b = boltzmann(g, rho);
        t += gamma / rho * b;
        sums[4] -= gamma * b;
    }
    REAL kkt = g > 0 || t < 0 ? t : 0;
    sums[0] += (double)kkt * kkt;
    sums[1] += kkt;
    sums[2] += fabs((double)t * g);
    sums[3] += g;
    sums[5] += g <= 0;
    return kkt;
}

// gap += scale * step, stopped by the wall.
extern "C" __global__ void apply_step(int nx, int ny, REAL *gap, REAL scale, const float *step) {
    NODES {
        index i = (index)y * nx + x;
        gap[i] = moved(gap[i], scale, step[i]);
    }
}

// work = gap + scale * step.
extern "C" __global__ void shifted(int nx, int ny, int pitch, const REAL *gap, REAL scale, const float *step, REAL *work) {
    NODES {
        index i = (index)y * nx + x;
        work[(index)y * pitch + x] = moved(gap[i], scale, step[i]);
    }
}

// work = gap.
extern "C" __global__ void copy_to_work(int nx, int ny, int pitch, const REAL *gap, REAL *work) {
    NODES work[(index)y * pitch + x] = gap[(index)y * nx + x];
}

// gap = max(work, 0).
extern "C" __global__ void clipped(int nx, int ny, int pitch, const REAL *work, REAL *gap) {
    NODES {
        REAL g = work[(index)y * pitch + x];
        gap[(index)y * nx + x] = g > 0 ? g : 0;
    }
}

// Sums of the state gap + scale * step (add_state), and of the residual times the old one.
extern "C" __global__ void trial(int nx, int ny, int pitch, const REAL *gap, REAL scale, const float *step,
                                 const REAL *work, REAL pressure, float *residual, REAL gamma, REAL rho, double *out) {
    double sums[7] = {0};
    NODES {
        index i = (index)y * nx + x;
        REAL before = gap[i], g = moved(before, scale, step[i]);
        float r = residual[i];
        float old = (float)before > 0 ? r : fminf(r, 0);
        REAL t = work[(index)y * pitch + x] + pressure;
        REAL kkt = add_state(sums, g, t, gamma, rho);
        sums[6] += (double)kkt * old;
        residual[i] = t;
    }
    reduce<7>(sums, out);
}

// Direction -t + beta d on the free nodes, also to step and work. Sums t d and v'' d².
extern "C" __global__ void plain(int nx, int ny, int pitch, REAL *gap, REAL pending, float *step, bf16 *direction,
                                 float beta, const float *gradient, float *work, REAL gamma, REAL rho, double *out) {
    double sums[2] = {0};
    NODES {
        index i = (index)y * nx + x;
        REAL g = moved(gap[i], pending, step[i]);
        gap[i] = g;
        float t = gradient[i];
        bool moves = is_free(g, t);
        float d = moves ? beta * wide(direction[i]) - t : 0;
        direction[i] = moves ? rounded_direction(d) : CLOSED;
        step[i] = d;
        work[(index)y * pitch + x] = d;
        sums[0] += (double)t * d;
        sums[1] += (double)force(g, d, gamma, rho) * d;
    }
    reduce<2>(sums, out);
}

// Residual -t on the free nodes, also to work; step and direction zero. Sums r².
extern "C" __global__ void begin(int nx, int ny, int pitch, REAL *gap, REAL pending, float *step, bf16 *direction,
                                 float *residual, float *work, double *out) {
    double sums[1] = {0};
    NODES {
        index i = (index)y * nx + x;
        REAL g = moved(gap[i], pending, step[i]);
        gap[i] = g;
        step[i] = 0;
        float t = residual[i];
        bool moves = is_free(g, t);
        float r = moves ? -t : 0;
        residual[i] = r;
        direction[i] = moves ? 0 : CLOSED;
        work[(index)y * pitch + x] = r;
        sums[0] += (double)r * r;
    }
    reduce<1>(sums, out);
}

// d = z + beta d on the free nodes, with z in work, which becomes d. Sums v'' d².
extern "C" __global__ void conjugate(int nx, int ny, int pitch, const REAL *gap, bf16 *direction, float beta,
                                     float *work, REAL gamma, REAL rho, double *out) {
    double sums[1] = {0};
    NODES {
        index i = (index)y * nx + x, k = (index)y * pitch + x;
        bf16 before = direction[i];
        float d = 0;
        if (before != CLOSED) {
            bf16 to = rounded_direction(work[k] + beta * wide(before));
            direction[i] = to;
            d = wide(to);
        }
        work[k] = d;
        if (LAW) sums[0] += (double)force(gap[i], d, gamma, rho) * d;
    }
    reduce<1>(sums, out);
}

// x += alpha d and r -= alpha H d on the free nodes, with K d in work, which becomes r. Sums r².
extern "C" __global__ void descend(int nx, int ny, int pitch, const REAL *gap, const bf16 *direction, float alpha,
                                   float *step, float *residual, float *work, REAL gamma, REAL rho, double *out) {
    double sums[1] = {0};
    NODES {
        index i = (index)y * nx + x, k = (index)y * pitch + x;
        bf16 stored = direction[i];
        float r = 0;
        if (stored != CLOSED) {
            float d = wide(stored), stress = work[k];
            if (LAW) stress += force(gap[i], d, gamma, rho);
            r = residual[i] - alpha * stress;
            step[i] += alpha * d;
        }
        residual[i] = r;
        work[k] = r;
        sums[0] += (double)r * r;
    }
    reduce<1>(sums, out);
}

extern "C" __global__ void step_along_direction(int nx, int ny, const bf16 *direction, float *step) {
    NODES {
        index i = (index)y * nx + x;
        step[i] = wide(direction[i]);
    }
}

// stress = work + pressure, and the sums of the state as in `trial`.
extern "C" __global__ void stress(int nx, int ny, int pitch, const REAL *gap, const REAL *work, REAL pressure, REAL *stress,
                                  REAL gamma, REAL rho, double *out) {
    double sums[6] = {0};
    NODES {
        index i = (index)y * nx + x;
        REAL g = gap[i], t = work[(index)y * pitch + x] + pressure;
        stress[i] = t;
        add_state(sums, g, t, gamma, rho);
    }
    reduce<6>(sums, out);
}

// Stiffness of a mode: of the table of a body, or of the half-space. Rows of negative modes have that of the positive ones.
template <typename real>
__device__ inline real stiffness(int i, int j, int half, int ny, double qx, double qy, const REAL *table) {
    int mode = 2 * j <= ny ? j : ny - j;
    if (table) return (real)table[(index)mode * half + i];
    real x = (real)qx * i, y = (real)qy * mode;
    return (real)0.5 * sqrt(x * x + y * y);
}

// Weight of a column of the half spectrum in sums over the whole.
__device__ inline double weight(int i, int nx) { return i == 0 || 2 * i == nx ? 1 : 2; }

// Coefficient of the heights: `up` rows of positive modes and `down` rows of negative ones, `width` columns each.
__device__ inline COMPLEX(REAL) height(int i, int j, int ny, const COMPLEX(REAL) *heights, int width, int up, int down) {
    int row = j < up ? j : j >= ny - down ? up + j - (ny - down) : -1;
    COMPLEX(REAL) h = {0, 0};
    return i < width && row >= 0 ? heights[(index)row * width + i] : h;
}

// The spectrum of a gap becomes that of the elastic stress K (g - h), over the number of nodes `n`. `spring` and
// `target`: stiffness of the mean mode, and the mean gap that it is relaxed at. Sums weight * factor * |c|².
extern "C" __global__ void displaced(int real_nx, int ny, double qx, double qy, const REAL *table,
                                     const COMPLEX(REAL) *heights, int width, int up, int down, double spring,
                                     double target, double n, COMPLEX(REAL) *work, double *out) {
    double sums[1] = {0};
    int nx = real_nx / 2 + 1;
    NODES {
        index k = (index)y * nx + x;
        COMPLEX(REAL) c = work[k], h = height(x, y, ny, heights, width, up, down);
        c.x -= (REAL)n * h.x;
        c.y -= (REAL)n * h.y;
        REAL factor = stiffness<REAL>(x, y, nx, ny, qx, qy, table);
        if (x == 0 && y == 0) {
            c.x -= (REAL)(n * target);
            factor = (REAL)spring;
        }
        sums[0] += weight(x, real_nx) * factor * ((double)c.x * c.x + (double)c.y * c.y);
        REAL scale = factor * (REAL)(1 / n);
        c.x *= scale;
        c.y *= scale;
        work[k] = c;
    }
    reduce<1>(sums, out);
}

// Multiplies a spectrum of the linear problem by the stiffness or, if `inverse`, by the compliance, over `n`; `mean` is
// the factor of the mean mode. Sums weight * factor * |c|². `write` is zero if only the sum is wanted.
extern "C" __global__ void multiplied(int real_nx, int ny, double qx, double qy, const REAL *table, int inverse, int write,
                                      double mean, double n, float2 *work, double *out) {
    double sums[1] = {0};
    int nx = real_nx / 2 + 1;
    NODES {
        index k = (index)y * nx + x;
        float2 c = work[k];
        float factor = stiffness<float>(x, y, nx, ny, qx, qy, table);
        if (inverse) factor = 1 / factor;
        if (x == 0 && y == 0) factor = mean;
        sums[0] += weight(x, real_nx) * factor * ((double)c.x * c.x + (double)c.y * c.y);
        if (write) {
            float scale = factor * (float)(1 / n);
            c.x *= scale;
            c.y *= scale;
            work[k] = c;
        }
    }
    reduce<1>(sums, out);
}

// Spectrum of the gap on a finer grid: `known` times `per_point` for the modes that both grids resolve (columns up to
// `right`, rows up to `top`), the heights for the others.
extern "C" __global__ void refined(int real_nx, int ny, const COMPLEX(REAL) *heights, int width, int up, int down,
                                   const COMPLEX(REAL) *known, int old_nx, int old_ny, int right, int top, REAL per_point,
                                   COMPLEX(REAL) *work) {
    int nx = real_nx / 2 + 1, old_half = old_nx / 2 + 1;
    NODES {
        COMPLEX(REAL) c = height(x, y, ny, heights, width, up, down);
        int row = y <= top ? y : ny - y <= top ? old_ny - (ny - y) : -1;
        if (x <= right && row >= 0) {
            c = known[(index)row * old_half + x];
            c.x *= per_point;
            c.y *= per_point;
        }
        work[(index)y * nx + x] = c;
    }
}
