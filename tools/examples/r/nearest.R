# Distances of points to the nearest neurite: Rscript nearest.R SET.fil, after R CMD SHLIB filiform_r.c (README.md).
dyn.load(paste0("filiform_r", .Platform$dynlib.ext))
nearest <- function(set, points) {  # points: one column each
  n <- ncol(points)
  r <- .C("filiform_r_nearest", set, as.double(points), n, distance = numeric(n), cell = integer(n), status = 0L, text = "")
  if (r$status != 0L) stop(r$text)
  data.frame(distance = r$distance, cell = r$cell)
}
print(nearest(commandArgs(TRUE)[1], cbind(c(0, 700, 0), c(100, 600, 50))))
