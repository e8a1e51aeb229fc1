function my_name(problems, answers)
% my-name: a complete calibrator for `calibench gate`, in Octave, and in MATLAB by files.
%
%     calibench gate --solver "octave-cli --quiet --eval my_name"
%
% MATLAB, where this was not tried yet, cannot be asked at a pipe. It answers all problems at once:
%
%     calibench gate export asked
%     matlab -batch "my_name('asked/problems.jsonl', 'asked/answers.jsonl')"
%     calibench gate judge asked
%
% It reads problems, a JSON object a line, and writes answers, a JSON object a line. These two functions, `answer` and the JSON at
% the end can stay; put your own calibrator in the place of `solve`. What it does now: homographies, a focal length from them, and
% Gauss-Newton with Levenberg's damping and numerical derivatives (Zhang 2000). It states its covariance, and refuses what it
% cannot solve. It wants Octave 7 or MATLAB R2016b, whose `jsondecode` it reads problems with, and no package or toolbox.
    if nargin == 0
        at_a_pipe();
        return;
    end
    in = fopen(problems, 'r');
    out = fopen(answers, 'w');
    line = fgetl(in);
    while ischar(line)
        fprintf(out, '%s\n', answer(line));
        line = fgetl(in);
    end
    fclose(in);
    fclose(out);
end

% `fgetl` of Octave looks one letter beyond the line, and would wait for the next problem before this one is answered.
function at_a_pipe()
    while true
        try
            line = input('', 's');
        catch
            return; % the end of the problems
        end
        fprintf('%s\n', answer(line));
        fflush(stdout);
    end
end

% --- What is asked ---------------------------------------------------------------------------------------------------------

% Cameras are columns in this order.
function names = parameter_names()
    names = {'fx', 'fy', 'cx', 'cy', 'skew', 'k1', 'k2', 'p1', 'p2', 'k3'};
end

% A problem has `image_size`, `views` (cells with `target` and `pixels`, 2 x N), `free` and `held` (places in the camera) and
% `values` (of what is held).
function problem = problem_of(json)
    problem.image_size = json.image_size(:)';
    problem.views = {};
    asked = cells_of(json.views);
    for v = 1:numel(asked)
        view.target = points_of(asked{v}.target);
        view.pixels = points_of(asked{v}.pixels);
        problem.views{end + 1} = view;
    end
    problem.free = places_of(cells_of(json.free));
    held = {};
    problem.values = [];
    if isstruct(json.held)
        held = fieldnames(json.held);
        problem.values = cellfun(@(name) json.held.(name), held(:)');
    end
    problem.held = places_of(held);
end

% JSON's lists come as cells, as an array of structures, or as an empty matrix.
function cells = cells_of(list)
    if iscell(list)
        cells = list;
    else
        cells = num2cell(list);
    end
end

% What was not measured is `null`, which is NaN here.
function points = points_of(list)
    if ~isnumeric(list) || (~isempty(list) && size(list, 2) ~= 2)
        refuse('a point is no pair of numbers');
    end
    points = reshape(list, [], 2)';
end

function places = places_of(names)
    places = zeros(1, numel(names));
    for i = 1:numel(names)
        place = find(strcmp(names{i}, parameter_names()));
        if isempty(place)
            refuse(['no parameter is called ' names{i}]);
        end
        places(i) = place;
    end
end

% Why there is no answer; its text is told.
function refuse(why)
    error('calibrator:refused', '%s', why);
end

% --- The camera ------------------------------------------------------------------------------------------------------------

% A pose, [rotation, translation], after a step: exp(w) on the left of its rotation (Rodrigues), and a shift.
function next = moved(pose, step)
    angle = norm(step(1:3));
    s = 1;
    c = 0.5;
    if angle >= 1e-9
        s = sin(angle) / angle;
        c = (1 - cos(angle)) / angle ^ 2;
    end
    cross_w = [0, -step(3), step(2); step(3), 0, -step(1); -step(2), step(1), 0];
    turned = pose(:, 1:3) + s * cross_w * pose(:, 1:3) + c * cross_w * (cross_w * pose(:, 1:3));
    next = [turned, pose(:, 4) + step(4:6)];
end

% Pixels (2 x N) of points of the target (2 x N); the equations are those of the protocol.
function pixels = project(camera, pose, target)
    p = pose(:, 1:2) * target + pose(:, 4) * ones(1, size(target, 2));
    x = p(1, :) ./ p(3, :);
    y = p(2, :) ./ p(3, :);
    s = x .^ 2 + y .^ 2;
    g = 1 + s .* (camera(6) + s .* (camera(7) + s * camera(10)));
    xd = x .* g + 2 * camera(8) * x .* y + camera(9) * (s + 2 * x .^ 2);
    yd = y .* g + camera(8) * (s + 2 * y .^ 2) + 2 * camera(9) * x .* y;
    pixels = [camera(1) * xd + camera(5) * yd + camera(3); camera(2) * yd + camera(4)];
end

% --- The start -------------------------------------------------------------------------------------------------------------

% Moves points' middle to 0 and makes their mean distance from it sqrt(2).
function T = normaliser(points)
    middle = mean(points, 2);
    away = points - middle * ones(1, size(points, 2));
    size_of_all = mean(sqrt(sum(away .^ 2, 1)));
    if ~(size_of_all > 0)
        refuse('all points of a view are one');
    end
    scale = sqrt(2) / size_of_all;
    T = [scale, 0, -scale * middle(1); 0, scale, -scale * middle(2); 0, 0, 1];
end

% From the target's plane to pixels, by the direct linear transform with both sides about their middle.
function H = homography(view)
    T = normaliser(view.target);
    U = normaliser(view.pixels);
    n = size(view.target, 2);
    t = T * [view.target; ones(1, n)];
    u = U * [view.pixels; ones(1, n)];
    zero = zeros(3, n);
    rows = [t; zero; -[1; 1; 1] * u(1, :) .* t]';
    rows = [rows; [zero; t; -[1; 1; 1] * u(2, :) .* t]'];
    % Four points have eight rows: a ninth of zeros gives V all of its nine columns.
    [~, ~, V] = svd([rows; zeros(1, 9)], 0);
    H = U \ (reshape(V(:, 9), 3, 3)' * T);
    H = H / norm(H, 'fro');
end

% The pose behind a homography to pixels about (cx, cy): two columns of the rotation, the translation, in front of the camera.
function pose = pose_of(H, fx, fy)
    M = diag([1 / fx, 1 / fy, 1]) * H;
    M = M * 2 / (norm(M(:, 1)) + norm(M(:, 2)));
    if M(3, 3) < 0
        M = -M;
    end
    a = M(:, 1) / norm(M(:, 1));
    b = M(:, 2) - a * (a' * M(:, 2));
    b = b / norm(b);
    pose = [a, b, cross(a, b), M(:, 3)];
end

% The focal lengths with the principal point in the image's middle: columns of K^-1 H are perpendicular and equally long.
function state = start(problem)
    camera = zeros(10, 1);
    camera(3:4) = (problem.image_size - 1) / 2;
    camera(problem.held) = problem.values;
    homographies = {};
    rows = [];
    right = [];
    for v = 1:numel(problem.views)
        H = [1, 0, -camera(3); 0, 1, -camera(4); 0, 0, 1] * homography(problem.views{v});
        homographies{v} = H;
        rows = [rows; (H(1:2, 1) .* H(1:2, 2))'; (H(1:2, 1) .^ 2 - H(1:2, 2) .^ 2)'];
        right = [right; -H(3, 1) * H(3, 2); H(3, 2) ^ 2 - H(3, 1) ^ 2];
    end
    % Parallel planes give no solution that is sure: any focal length will do to begin with.
    inverse_squares = pinv(rows) * right;
    for i = intersect([1, 2], problem.free)
        camera(i) = problem.image_size(1);
        if inverse_squares(i) > 0
            camera(i) = 1 / sqrt(inverse_squares(i));
        end
    end
    state.camera = camera;
    state.poses = cellfun(@(H) pose_of(H, camera(1), camera(2)), homographies, 'UniformOutput', false);
end

% --- The refinement --------------------------------------------------------------------------------------------------------

% The steps of the camera come first, then six for every view.
function next = stepped(state, free, step)
    next = state;
    next.camera(free) = next.camera(free) + step(1:numel(free));
    for v = 1:numel(state.poses)
        from = numel(free) + 6 * (v - 1);
        next.poses{v} = moved(state.poses{v}, step(from + 1:from + 6));
    end
end

% u and v of every point in turn, view after view.
function r = residuals(views, state)
    parts = cell(numel(views), 1);
    for v = 1:numel(views)
        away = project(state.camera, state.poses{v}, views{v}.target) - views{v}.pixels;
        parts{v} = away(:);
    end
    r = vertcat(parts{:});
end

% Normal equations and gradient by central differences; a pose moves the pixels of its own view only.
function [normal, gradient] = linearise(views, state, free, r)
    count = numel(free);
    n = count + 6 * numel(views);
    normal = zeros(n);
    gradient = zeros(n, 1);
    done = 0;
    for v = 1:numel(views)
        target = views{v}.target;
        pose = state.poses{v};
        J = zeros(2 * size(target, 2), count + 6);
        for k = 1:count
            h = 1e-6 * max(1, abs(state.camera(free(k))));
            step = zeros(10, 1);
            step(free(k)) = h;
            slope = project(state.camera + step, pose, target) - project(state.camera - step, pose, target);
            J(:, k) = slope(:) / (2 * h);
        end
        for k = 1:6
            step = zeros(6, 1);
            step(k) = 1e-6;
            ahead = project(state.camera, moved(pose, step), target);
            slope = ahead - project(state.camera, moved(pose, -step), target);
            J(:, count + k) = slope(:) / 2e-6;
        end
        places = [1:count, count + 6 * (v - 1) + (1:6)];
        normal(places, places) = normal(places, places) + J' * J;
        gradient(places) = gradient(places) + J' * r(done + (1:size(J, 1)));
        done = done + size(J, 1);
    end
end

% Divides rows and columns by the roots of the diagonal, so that units do not matter.
function [scaled, scale] = equilibrate(normal)
    scale = sqrt(diag(normal));
    if ~all(scale > 0)
        refuse('a parameter has no influence');
    end
    scaled = normal ./ (scale * scale');
end

% A target of unit size makes rotations and translations alike.
function [problem, unit] = checked(problem)
    if isempty(problem.views)
        refuse('no views');
    end
    all_points = [];
    for v = 1:numel(problem.views)
        view = problem.views{v};
        if size(view.target, 2) ~= size(view.pixels, 2)
            refuse('points and pixels do not pair');
        elseif size(view.target, 2) < 4
            refuse('fewer than four points in a view');
        elseif ~all(isfinite([view.target(:); view.pixels(:)]))
            refuse('a coordinate was not measured');
        end
        all_points = [all_points, view.target];
    end
    unit = sqrt(mean(sum(all_points .^ 2, 1)));
    for v = 1:numel(problem.views)
        problem.views{v}.target = problem.views{v}.target / unit;
    end
end

% The state of least squares, and whether it is one: the descent ended by itself.
function [state, converged] = refined(problem, state)
    converged = false;
    damping = 1e-3;
    r = residuals(problem.views, state);
    for iteration = 1:100
        [normal, gradient] = linearise(problem.views, state, problem.free, r);
        [normal, scale] = equilibrate(normal);
        while true
            if damping > 1e8
                converged = true; % no step lowers the cost
                return;
            end
            [R, failed] = chol(normal + damping * eye(numel(scale)));
            if ~failed
                step = (R \ (R' \ (-gradient ./ scale))) ./ scale;
                next = stepped(state, problem.free, step);
                after = residuals(problem.views, next);
                if after' * after <= r' * r
                    break;
                end
            end
            damping = 10 * damping;
        end
        gain = r' * r - after' * after;
        state = next;
        r = after;
        damping = max(damping / 10, 1e-15);
        if gain <= 1e-15 * (r' * r) + 1e-24
            converged = true;
            return;
        end
    end
end

function result = solve(problem)
    [problem, unit] = checked(problem);
    [state, result.converged] = refined(problem, start(problem));
    r = residuals(problem.views, state);
    normal = linearise(problem.views, state, problem.free, r);
    [normal, scale] = equilibrate(normal);
    freedom = numel(r) - numel(scale);
    if freedom < 0 || ~(cond(normal) <= 1e9)
        refuse('the data do not determine the parameters');
    end
    covariance = inv(normal) ./ (scale * scale') * (r' * r) / max(freedom, 1);
    count = numel(problem.free);
    result.covariance = (covariance(1:count, 1:count) + covariance(1:count, 1:count)') / 2;
    result.camera = state.camera;
    result.poses = state.poses;
    for v = 1:numel(result.poses)
        result.poses{v}(:, 4) = result.poses{v}(:, 4) * unit;
    end
    result.rmse = sqrt(2 * (r' * r) / numel(r));
end

% --- JSON ------------------------------------------------------------------------------------------------------------------

function text = joined(texts)
    text = strjoin(texts, ',');
end

% Seventeen digits read back as the same bits; `jsonencode` writes fifteen.
function text = numbers(values)
    texts = arrayfun(@(value) sprintf('%.17g', value), values(:)', 'UniformOutput', false);
    text = ['[' joined(texts) ']'];
end

function text = matrix(values)
    rows = arrayfun(@(i) numbers(values(i, :)), 1:size(values, 1), 'UniformOutput', false);
    text = ['[' joined(rows) ']'];
end

function text = pose_text(pose)
    text = sprintf('{"rotation":%s,"translation":%s}', matrix(pose(:, 1:3)), numbers(pose(:, 4)));
end

function text = answer_text(problem, result)
    names = parameter_names();
    names = names(problem.free);
    status = 'not_converged';
    if result.converged
        status = 'ok';
    end
    values = cellfun(@(name, value) sprintf('"%s":%.17g', name, value), names, ...
        num2cell(result.camera(problem.free)'), 'UniformOutput', false);
    quoted = cellfun(@(name) ['"' name '"'], names, 'UniformOutput', false);
    poses = cellfun(@pose_text, result.poses, 'UniformOutput', false);
    text = [sprintf('"status":"%s","parameters":{%s},"poses":[%s],', status, joined(values), joined(poses)), ...
        sprintf('"covariance":{"parameters":[%s],"matrix":%s},', joined(quoted), matrix(result.covariance)), ...
        sprintf('"rmse":%.17g', result.rmse)];
end

function text = answer(line)
    id = '';
    try
        json = jsondecode(line);
        id = json.id;
        problem = problem_of(json);
        said = answer_text(problem, solve(problem));
    catch failure
        % What is told stands between quotation marks, on one line.
        why = regexprep(failure.message, '["\\\s]', ' ');
        said = sprintf('"status":"refused","message":"%s"', why);
    end
    text = sprintf('{"id":"%s",%s}', id, said);
end
