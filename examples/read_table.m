function [values, errors] = read_table(table, x)
% A table of a function from its netCDF file, by ncread (MATLAB; in Octave `pkg load netcdf`).
%   t = read_table('force.nc')         reads it
%   [v, e] = read_table(t, x)          values and bounds on their absolute errors at points x, one a row
%   worst = read_table(t, 'selftest')  the largest error at the points of the file over its bound, at most 1
% A row is NaN where the table has no answer. docs/tutorials/functions.md says what the variables mean.
errors = [];
if ischar(table)
  values = read(table);
elseif ischar(x) && strcmp(x, 'selftest')
  [v, e] = read_table(table, table.conformance_x);
  values = max(max(abs(v - table.conformance_exact) ./ e));
else
  if size(x, 2) ~= size(table.axis_numbers, 1)
    error('read_table: x must have %d columns, one an axis', size(table.axis_numbers, 1));
  end
  values = nan(size(x, 1), size(table.output_numbers, 1));
  errors = values;
  for k = 1:size(x, 1)
    [values(k, :), errors(k, :)] = answer(table, x(k, :));
  end
end
end

function t = read(path)
names = {'axis_numbers', 'output_numbers', 'branches', 'middles', 'starts', 'terms', ...
         'coefficients', 'errors', 'conformance_x', 'conformance_exact'};
for k = 1:numel(names)
  % the first dimension of the file is the last here
  t.(names{k}) = ncread(path, names{k}).';
end
end

function [values, errors] = answer(t, x)
count = numel(x);
values = nan(1, size(t.output_numbers, 1));
errors = values;
low = t.axis_numbers(:, 4);
high = t.axis_numbers(:, 5);
place = zeros(1, count);
for k = 1:count
  place(k) = coordinate(t.axis_numbers(k, :), x(k));
end
if any(isnan(place))
  return
end
box = 1;
while t.branches(box, 1) >= 0
  axis = t.branches(box, 1) + 1;
  upper = place(axis) >= t.middles(box);
  if upper
    low(axis) = t.middles(box);
  else
    high(axis) = t.middles(box);
  end
  box = t.branches(box, 2) + upper + 1;
end
if t.branches(box, 1) ~= -1
  return
end
number = t.branches(box, 2) + 1;
products = 1;
for k = 1:count
  y = min(max((place(k) - low(k)) * (2 / (high(k) - low(k))) - 1, -1), 1);
  own = cos((0:t.terms(number, k) - 1)' * acos(y));
  products = reshape(own * products, 1, []);
end
for k = 1:numel(values)
  first = t.starts(number) + (k - 1) * numel(products) + 1;
  values(k) = products * t.coefficients(first:first + numel(products) - 1).';
  about = t.output_numbers(k, :);
  errors(k) = t.errors(number, k);
  if about(1)
    values(k) = exp(values(k));
    errors(k) = values(k) * expm1(errors(k));
  elseif about(2)
    errors(k) = errors(k) * max(abs(values(k)), about(3)) / (1 - min(errors(k), 0.5));
  end
end
end

function t = coordinate(axis, x)
t = nan;
if ~(x >= axis(1) && x <= axis(2))
  if ~isfinite(x) || axis(7) == 0
    return
  end
  if axis(7) == 2
    x = x - (axis(2) - axis(1)) * floor((x - axis(1)) / (axis(2) - axis(1)));
  end
  x = min(max(x, axis(1)), axis(2));
end
t = x;
if axis(6)
  t = log(x + axis(3));
end
end
